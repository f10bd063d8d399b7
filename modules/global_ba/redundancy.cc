#include "global_ba/redundancy.h"

#include <algorithm>

namespace pangea {
namespace {

// A keyframe is redundant if at least this share of its landmarks is seen by this many others.
constexpr double kRedundantShare = 0.9;
constexpr int kObservers = 3;

class Culling {
 public:
  explicit Culling(const BaWorld& world)
      : world_(world),
        next_(world.keyframes.size(), -1),
        seen_(world.keyframes.size()),
        observers_(world.landmarks.size(), 0),
        gone_(world.keyframes.size(), false) {
    for (int i = 0; i < static_cast<int>(world.keyframes.size()); ++i) {
      if (world.keyframes[i].previous >= 0) {
        next_[world.keyframes[i].previous] = i;
      }
    }
    for (const BaObservation& seen : world.observations) {
      seen_[seen.keyframe].push_back(seen.landmark);
      ++observers_[seen.landmark];
    }
  }

  void Run(const std::vector<Cull>& cull) {
    for (int i = 0; i < static_cast<int>(cull.size()); ++i) {
      if (cull[i] == Cull::kAlways) {
        Remove(i);
      }
    }
    for (int i = 0; i < static_cast<int>(cull.size()); ++i) {
      if (cull[i] == Cull::kIfRedundant && MayLeave(i) && IsSeenByOthers(i)) {
        Remove(i);
      }
    }
  }

  BaWorld Result() const {
    BaWorld result;
    result.cameras = world_.cameras;
    std::vector<int> new_index(gone_.size(), -1);
    for (size_t i = 0; i < gone_.size(); ++i) {
      if (!gone_[i]) {
        new_index[i] = static_cast<int>(result.keyframes.size());
        BaKeyframe keyframe = world_.keyframes[i];
        keyframe.previous = keyframe.previous < 0 ? -1 : new_index[keyframe.previous];
        result.keyframes.push_back(std::move(keyframe));
      }
    }
    result.landmarks = world_.landmarks;
    for (BaObservation seen : world_.observations) {
      if (!gone_[seen.keyframe]) {
        seen.keyframe = new_index[seen.keyframe];
        result.observations.push_back(seen);
      }
    }
    DropUnderobservedLandmarks(&result);
    return result;
  }

 private:
  bool MayLeave(int i) const {
    const BaKeyframe& keyframe = world_.keyframes[i];
    if (keyframe.previous < 0 || next_[i] < 0) {
      return false;
    }
    const int64_t gap_us =
        world_.keyframes[next_[i]].utime - world_.keyframes[keyframe.previous].utime;
    return 1e-6 * static_cast<double>(gap_us) <= kMaxGap_s;
  }

  bool IsSeenByOthers(int i) const {
    const auto enough = std::ranges::count_if(
        seen_[i], [this](int landmark) { return observers_[landmark] > kObservers; });
    return static_cast<double>(enough) >= kRedundantShare * static_cast<double>(seen_[i].size());
  }

  void Remove(int i) {
    gone_[i] = true;
    for (const int landmark : seen_[i]) {
      --observers_[landmark];
    }
    const BaKeyframe& keyframe = world_.keyframes[i];
    if (keyframe.previous >= 0) {
      next_[keyframe.previous] = next_[i];
    }
    if (next_[i] >= 0) {
      Bridge(keyframe, &world_.keyframes[next_[i]]);
    }
  }

  static void Bridge(const BaKeyframe& keyframe, BaKeyframe* over) {
    BaKeyframe& next = *over;
    next.previous = keyframe.previous;
    if (keyframe.preintegration && next.preintegration) {
      next.preintegration = Compose(*keyframe.preintegration, *next.preintegration);
    } else {
      next.preintegration.reset();
    }
    if (keyframe.edge && next.edge) {
      next.edge = {keyframe.edge->T_previous_this * next.edge->T_previous_this,
                   ComposeCovariance(keyframe.edge->T_previous_this, keyframe.edge->covariance,
                                     next.edge->T_previous_this, next.edge->covariance)};
    } else {
      next.edge.reset();
    }
  }

  BaWorld world_;
  std::vector<int> next_;               // by keyframe: the next one in its map, or -1
  std::vector<std::vector<int>> seen_;  // by keyframe: its landmarks
  std::vector<int> observers_;          // by landmark: number of keyframes that see it
  std::vector<bool> gone_;
};

}  // namespace

BaWorld WithoutRedundant(const BaWorld& world, const std::vector<Cull>& cull) {
  Culling culling(world);
  culling.Run(cull);
  return culling.Result();
}

}  // namespace pangea
