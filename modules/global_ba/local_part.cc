#include "global_ba/local_part.h"

#include <algorithm>
#include <cstdlib>
#include <iterator>
#include <utility>

namespace pangea {
namespace {

// An agent that stands still sees the same landmarks for hours: keyframes further away, in seq,
// count as seeing none of them.
constexpr int32_t kMaxReach = 100;

class Chooser {
 public:
  Chooser(const MapPoses& state, const AdjustedGroup& adjusted, const MatchedPairs& pairs,
          KeyframeStore* store)
      : state_(state), adjusted_(adjusted), pairs_(pairs), store_(store) {}

  LocalPart Choose(const std::vector<KeyframePair>& new_pairs, int max_neighbours) {
    for (const auto& [id, pose] : state_) {
      if (!adjusted_.Knows(id)) {
        new_.insert(id);
      }
    }
    LocalPart part;
    part.moving = new_;
    const size_t max_moving = new_.size() + static_cast<size_t>(max_neighbours);
    for (const auto& [query, match] : new_pairs) {
      for (const KeyframeId& end : {query, match}) {
        if (part.moving.size() < max_moving) {
          part.moving.insert(end);
        }
      }
    }
    std::vector<KeyframeId> newest(part.moving.begin(), part.moving.end());
    while (!newest.empty() && part.moving.size() < max_moving) {
      newest = Neighbours(newest, part.moving, max_moving - part.moving.size());
      part.moving.insert(newest.begin(), newest.end());
    }
    part.fixed = Around(part.moving);
    for (const KeyframeId& id : part.moving) {
      part.fixed.erase(id);
    }
    return part;
  }

 private:
  using Shared = std::map<KeyframeId, int>;  // landmarks

  // The keyframes not in `known` that share most landmarks with `ids`.
  std::vector<KeyframeId> Neighbours(const std::vector<KeyframeId>& ids,
                                     const std::set<KeyframeId>& known, size_t max_count) {
    Shared all;
    const auto count = [&](const KeyframeId& id) {
      for (const auto& [near, shared] : Along(id)) {
        if (!known.contains(near) && adjusted_.Find(near) != nullptr) {
          all[near] += shared;
        }
      }
    };
    for (const KeyframeId& id : ids) {
      count(id);
      std::ranges::for_each(PartnersOf(id), count);
    }
    std::vector<std::pair<int, KeyframeId>> ranked;
    for (const auto& [id, shared] : all) {
      ranked.emplace_back(-shared, id);
    }
    std::ranges::sort(ranked);
    ranked.resize(std::min(ranked.size(), max_count));
    std::vector<KeyframeId> neighbours;
    for (const auto& [shared, id] : ranked) {
      neighbours.push_back(id);
    }
    return neighbours;
  }

  // All keyframes that see landmarks of `ids`: along their own maps, and through matched pairs.
  std::set<KeyframeId> Around(const std::set<KeyframeId>& ids) {
    std::set<KeyframeId> around, partners;
    const auto add = [&](const KeyframeId& id) {
      for (const auto& [near, shared] : Along(id)) {
        around.insert(near);
      }
    };
    std::ranges::for_each(ids, add);
    for (const KeyframeId& id : around) {
      const std::vector<KeyframeId> of_one = PartnersOf(id);
      partners.insert(of_one.begin(), of_one.end());
    }
    std::ranges::for_each(partners, add);
    return around;
  }

  // Only partners in the group.
  std::vector<KeyframeId> PartnersOf(const KeyframeId& id) const {
    std::vector<KeyframeId> partners = pairs_.PartnersOf(id);
    std::erase_if(partners, [this](const KeyframeId& p) { return !state_.contains(p); });
    return partners;
  }

  // The keyframe, and its predecessors and successors as long as they see its landmarks; in both
  // directions at least up to the next keyframe of the adjustment, to which an edge connects it.
  const Shared& Along(const KeyframeId& id) {
    const auto [known, is_new] = along_.try_emplace(id);
    if (is_new) {
      Shared& along = known->second;
      along[id] = static_cast<int>(LandmarksOf(id).size());
      const auto here = state_.find(id);
      bool joined = false;
      for (auto it = std::next(here); it != state_.end() && Add(id, it->first, &joined, &along);) {
        ++it;
      }
      joined = false;
      for (auto it = here;
           it != state_.begin() && Add(id, std::prev(it)->first, &joined, &along);) {
        --it;
      }
    }
    return known->second;
  }

  // Adds `near` if it belongs to Along(id); false if not.
  bool Add(const KeyframeId& id, const KeyframeId& near, bool* joined, Shared* along) {
    const bool is_near = near.map == id.map && std::abs(near.seq - id.seq) <= kMaxReach;
    const int shared = is_near ? NumShared(id, near) : 0;
    if (near.map != id.map || (shared == 0 && *joined)) {
      return false;
    }
    (*along)[near] = shared;
    *joined = *joined || new_.contains(near) || adjusted_.Find(near) != nullptr;
    return true;
  }

  int NumShared(const KeyframeId& a, const KeyframeId& b) {
    std::vector<int32_t> shared;
    std::ranges::set_intersection(LandmarksOf(a), LandmarksOf(b), std::back_inserter(shared));
    return static_cast<int>(shared.size());
  }

  const std::vector<int32_t>& LandmarksOf(const KeyframeId& id) {
    const auto [known, is_new] = landmarks_.try_emplace(id);
    std::vector<int32_t>& landmarks = known->second;
    if (const auto view = is_new ? store_->Find(id) : nullptr) {
      for (const Corner& corner : view->keyframe().corners) {
        if (corner.landmark_id != kNoLandmark) {
          landmarks.push_back(corner.landmark_id);
        }
      }
      std::ranges::sort(landmarks);
      const auto repeats = std::ranges::unique(landmarks);
      landmarks.erase(repeats.begin(), repeats.end());
    }
    return landmarks;
  }

  const MapPoses& state_;
  const AdjustedGroup& adjusted_;
  const MatchedPairs& pairs_;
  KeyframeStore* store_;
  std::set<KeyframeId> new_;
  std::map<KeyframeId, std::vector<int32_t>> landmarks_;
  std::map<KeyframeId, Shared> along_;
};

}  // namespace

LocalPart ChooseLocalPart(const MapPoses& state, const AdjustedGroup& adjusted,
                          const MatchedPairs& pairs, const std::vector<KeyframePair>& new_pairs,
                          int max_neighbours, KeyframeStore* store) {
  return Chooser(state, adjusted, pairs, store).Choose(new_pairs, max_neighbours);
}

}  // namespace pangea
