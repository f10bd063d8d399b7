#include "place_recognition/place_recognition.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "place_recognition/guided_matching.h"

namespace pangea {
namespace {

constexpr uint64_t kSeedSalt = 0x706c616365;  // "place"
constexpr double kOctaveScale = 1.2;
// Runs of keyframes looked at before they are spread over the maps.
constexpr size_t kMaxPlaces = 100;

bool ShareAnElement(const std::vector<int32_t>& a, const std::vector<int32_t>& b) {
  auto i = a.begin();
  auto j = b.begin();
  while (i != a.end() && j != b.end()) {
    if (*i == *j) {
      return true;
    }
    *i < *j ? ++i : ++j;
  }
  return false;
}

std::vector<std::pair<CornerRay, CornerRay>> RayPairs(const std::vector<CornerRay>& a,
                                                      const std::vector<CornerRay>& b,
                                                      const std::vector<CornerMatch>& matches) {
  std::vector<std::pair<CornerRay, CornerRay>> pairs;
  pairs.reserve(matches.size());
  for (const CornerMatch& match : matches) {
    pairs.emplace_back(a[match.a], b[match.b]);
  }
  return pairs;
}

}  // namespace

PlaceRecognition::PlaceRecognition(PlaceRecognitionOptions options)
    : options_(std::move(options)) {}

PlaceMatch PlaceRecognition::Add(const Keyframe& keyframe) {
  Stored query = MakeStored(keyframe);
  PlaceMatch match;
  match.query = query.id;

  const std::vector<float> scores = index_.Query(query.corners);
  std::vector<Place> own;
  std::vector<Place> others;
  for (int i = 0; i < static_cast<int>(scores.size()); ++i) {
    if (scores[i] <= 0) {
      continue;
    }
    if (stored_[i].id.map != query.id.map) {
      others.push_back({i, scores[i]});
    } else if (!IsRecent(query, stored_[i])) {
      own.push_back({i, scores[i]});
    }
  }
  for (auto* hits : {&own, &others}) {
    std::vector<Place> chosen =
        Spread(Places(*hits), hits == &own ? options_.own_places : options_.other_places);
    for (const Place& place : Continued(query.id, *hits)) {
      if (std::none_of(chosen.begin(), chosen.end(),
                       [&](const Place& c) { return c.keyframe == place.keyframe; })) {
        chosen.push_back(place);
      }
    }
    (hits == &own ? counters_.places_own : counters_.places_other) +=
        static_cast<int64_t>(chosen.size());
    for (const Place& place : chosen) {
      Verify(query, place, &match);
    }
  }
  RememberPlaces(match);
  Store(std::move(query));
  return match;
}

void PlaceRecognition::Remember(const Keyframe& keyframe, const PlaceMatch& known) {
  RememberPlaces(known);
  Store(MakeStored(keyframe));
}

void PlaceRecognition::SetGroup(const MapId& group, int64_t revision,
                                const std::vector<MapId>& maps) {
  // A map that has left the group stands alone again until another group names it.
  for (auto& [map, state] : groups_) {
    if (state.group == group && state.revision <= revision) {
      state = {map, revision, false};
    }
  }
  for (const MapId& map : maps) {
    MapGroup& state = groups_[map];
    if (state.revision <= revision) {
      state = {group, revision, maps.size() > 1};
    }
  }
}

PlaceRecognition::Stored PlaceRecognition::MakeStored(const Keyframe& keyframe) {
  Stored stored{keyframe.id, keyframe.corners, {}, {}};
  const Eigen::Quaterniond q_odom_cam = keyframe.T_odom_cam().q;
  stored.rays.reserve(keyframe.corners.size());
  for (const Corner& corner : keyframe.corners) {
    CornerRay ray{Eigen::Vector3d::Zero(), 0};
    if (const auto xy = keyframe.camera.Unproject(corner.pixel.cast<double>())) {
      ray.direction = q_odom_cam * Eigen::Vector3d(xy->x(), xy->y(), 1.0).normalized();
      ray.sigma = keyframe.camera.PixelAngle() * std::pow(kOctaveScale, corner.octave);
    }
    stored.rays.push_back(ray);
    if (corner.landmark_id != kNoLandmark) {
      stored.landmarks.push_back(corner.landmark_id);
    }
  }
  std::sort(stored.landmarks.begin(), stored.landmarks.end());
  return stored;
}

void PlaceRecognition::Store(Stored stored) {
  ++counters_.keyframes;
  if (index_.size() < options_.max_keyframes) {
    index_.Add(stored.corners);
    stored_.push_back(std::move(stored));
  }
}

bool PlaceRecognition::IsRecent(const Stored& query, const Stored& other) const {
  return std::abs(query.id.seq - other.id.seq) < options_.min_seq_gap ||
         ShareAnElement(query.landmarks, other.landmarks);
}

std::vector<PlaceRecognition::Place> PlaceRecognition::Places(
    const std::vector<Place>& hits) const {
  std::vector<Place> sorted = hits;
  std::stable_sort(sorted.begin(), sorted.end(),
                   [](const Place& a, const Place& b) { return a.score > b.score; });
  std::vector<Place> places;
  std::map<MapId, std::vector<int32_t>> taken;
  for (const Place& hit : sorted) {
    const KeyframeId& id = stored_[hit.keyframe].id;
    std::vector<int32_t>& seqs = taken[id.map];
    if (std::none_of(seqs.begin(), seqs.end(), [&](int32_t seq) {
          return std::abs(seq - id.seq) <= 2 * options_.place_half_width;
        })) {
      seqs.push_back(id.seq);
      places.push_back(hit);
    }
    if (places.size() >= kMaxPlaces) {
      break;
    }
  }
  return places;
}

std::vector<PlaceRecognition::Place> PlaceRecognition::Spread(const std::vector<Place>& places,
                                                              int limit) const {
  // Half of them by score alone, then the best place of each map not yet among them, then by score.
  std::vector<Place> chosen;
  std::vector<bool> used(places.size(), false);
  std::vector<MapId> maps;
  const auto choose = [&](size_t i) {
    used[i] = true;
    chosen.push_back(places[i]);
    maps.push_back(stored_[places[i].keyframe].id.map);
  };
  const auto full = [&](int size) { return static_cast<int>(chosen.size()) >= size; };
  for (size_t i = 0; i < places.size() && !full(limit / 2); ++i) {
    choose(i);
  }
  for (size_t i = 0; i < places.size() && !full(limit); ++i) {
    const MapId& map = stored_[places[i].keyframe].id.map;
    if (!used[i] && std::find(maps.begin(), maps.end(), map) == maps.end()) {
      choose(i);
    }
  }
  for (size_t i = 0; i < places.size() && !full(limit); ++i) {
    if (!used[i]) {
      choose(i);
    }
  }
  return chosen;
}

std::vector<PlaceRecognition::Place> PlaceRecognition::Continued(
    const KeyframeId& query, const std::vector<Place>& hits) const {
  std::vector<Place> continued;
  const auto last = last_matches_.find(query.map);
  if (last == last_matches_.end()) {
    return continued;
  }
  for (const KeyframeId& match : last->second) {
    Place best{-1, 0};
    for (const Place& hit : hits) {
      const KeyframeId& id = stored_[hit.keyframe].id;
      if (id.map == match.map && std::abs(id.seq - match.seq) <= options_.place_half_width &&
          hit.score > best.score) {
        best = hit;
      }
    }
    if (best.keyframe >= 0) {
      continued.push_back(best);
    }
  }
  return continued;
}

void PlaceRecognition::Verify(const Stored& query, const Place& place, PlaceMatch* match) {
  const Stored& other = stored_[place.keyframe];
  std::vector<CornerMatch> matches = MatchCorners(query.corners, other.corners, options_.matching);
  std::erase_if(matches, [&](const CornerMatch& m) {
    return query.rays[m.a].sigma <= 0 || other.rays[m.b].sigma <= 0;
  });
  if (static_cast<int>(matches.size()) < options_.epipolar.min_inliers) {
    ++counters_.rejected_matching;
    match->rejected.push_back(
        fmt::format("{}: {} corner matches", ToString(other.id), matches.size()));
    return;
  }
  const EpipolarResult epipolar =
      CheckEpipolar(RayPairs(query.rays, other.rays, matches),
                    StableHash(query.id, other.id, kSeedSalt), options_.epipolar);
  if (!epipolar.accepted) {
    ++counters_.rejected_epipolar;
    match->rejected.push_back(fmt::format("{}: {} of {} matches agree on a pose",
                                          ToString(other.id), epipolar.inliers.size(),
                                          matches.size()));
    return;
  }
  PlaceCandidate candidate;
  candidate.match = other.id;
  candidate.kind = Kind(query.id.map, other.id.map);
  candidate.score = place.score;
  candidate.corner_matches = MatchAlongEpipolarLines(
      {query.corners, query.rays}, {other.corners, other.rays}, epipolar.model,
      options_.epipolar.max_residual, options_.guided_matching);
  ++(query.id.map == other.id.map ? counters_.candidates_own : counters_.candidates_other);
  match->candidates.push_back(std::move(candidate));
}

PlaceKind PlaceRecognition::Kind(const MapId& a, const MapId& b) const {
  const auto group = groups_.find(a);
  const bool fused = group != groups_.end() && group->second.fused;
  return a == b && !fused ? PlaceKind::kIntra : PlaceKind::kInter;
}

void PlaceRecognition::RememberPlaces(const PlaceMatch& match) {
  std::vector<KeyframeId>& last = last_matches_[match.query.map];
  last.clear();
  for (const PlaceCandidate& candidate : match.candidates) {
    last.push_back(candidate.match);
  }
}

}  // namespace pangea
