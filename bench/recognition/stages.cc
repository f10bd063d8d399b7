#include "bench/recognition/stages.h"

#include <algorithm>
#include <optional>
#include <set>

#include "bench/recognition/overlap.h"
#include "eval/metrics.h"
#include "loop_verification/loop_verifier.h"
#include "place_recognition/place_recognition.h"
#include "report/metrics/report_truth.h"

namespace pangea::bench {
namespace {

struct Known {
  KeyframeId id;
  Rigid3 T_reference_body;
  View view;
  std::set<int32_t> landmarks;
};

class Stages {
 public:
  explicit Stages(const std::map<int32_t, Trajectory>& truth) : truth_(truth) {}

  void Add(const Keyframe& keyframe) {
    intra_.Add(keyframe);
    inter_.Add(keyframe);
    std::vector<PlaceReport> places;
    const PlaceMatch match = recognition_.Add(keyframe, &places);
    const std::optional<Known> query = Know(keyframe);
    if (!query) {
      return;
    }
    ++outcome_.keyframes;
    NoteTrueOverlaps(*query);
    for (const PlaceReport& place : places) {
      if (const auto other = known_.find(place.match); other != known_.end()) {
        outcome_.retrieved.push_back(Follow(*query, other->second, place, match));
      }
    }
    known_.emplace(query->id, *query);
  }

  Outcome Take() { return std::move(outcome_); }

 private:
  std::optional<Known> Know(const Keyframe& keyframe) const {
    const auto truth = truth_.find(keyframe.id.map.agent_id);
    const auto pose = truth == truth_.end()
                          ? std::nullopt
                          : Interpolate(truth->second, keyframe.utime, kMaxGroundTruthGapUs);
    if (!pose) {
      return std::nullopt;
    }
    Known known{keyframe.id, *pose, ViewOf(keyframe, *pose), {}};
    for (const Corner& corner : keyframe.corners) {
      if (corner.landmark_id != kNoLandmark) {
        known.landmarks.insert(corner.landmark_id);
      }
    }
    return known;
  }

  // The same criterion as in place recognition: a recent keyframe is not a revisited place.
  bool IsRecent(const Known& query, const Known& other) const {
    return query.id.seq - other.id.seq < PlaceRecognition::kMinSeqGap ||
           std::any_of(query.landmarks.begin(), query.landmarks.end(),
                       [&](int32_t id) { return other.landmarks.contains(id); });
  }

  void NoteTrueOverlaps(const Known& query) {
    std::set<Search> found;
    for (const auto& [id, other] : known_) {
      const Search search = id.map == query.id.map ? Search::kOwnMap : Search::kOtherMaps;
      if (!found.contains(search) && !(search == Search::kOwnMap && IsRecent(query, other)) &&
          Overlap(query.view, other.view) >= kRightOverlap) {
        found.insert(search);
        outcome_.with_overlap[search].push_back(query.id);
      }
    }
  }

  Retrieved Follow(const Known& query, const Known& other, const PlaceReport& place,
                   const PlaceMatch& match) {
    Retrieved retrieved{.query = query.id, .match = other.id};
    retrieved.overlap = Overlap(query.view, other.view);
    retrieved.score = place.score;
    retrieved.epipolar_inliers = place.inliers;
    retrieved.verified = place.verified;
    const auto candidate =
        std::find_if(match.candidates.begin(), match.candidates.end(),
                     [&](const PlaceCandidate& c) { return c.match == other.id; });
    retrieved.published = candidate != match.candidates.end();
    if (!retrieved.published) {
      return retrieved;
    }
    LoopVerifier& verifier = candidate->kind == PlaceKind::kIntra
                                 ? static_cast<LoopVerifier&>(intra_)
                                 : static_cast<LoopVerifier&>(inter_);
    LoopVerificationReport report;
    const Constraint constraint = verifier.Verify(query.id, *candidate, &report);
    retrieved.pnp_inliers = static_cast<int>(report.Measured("min_pnp_inliers"));
    retrieved.landmarks = static_cast<int>(report.Measured("min_inliers"));
    retrieved.accepted = constraint.accepted;
    if (retrieved.landmarks > 0) {
      const Vector6d error =
          constraint.T_from_to.Minus(other.T_reference_body.Inverse() * query.T_reference_body);
      retrieved.error_m = error.head<3>().norm();
      retrieved.error_rad = error.tail<3>().norm();
    }
    return retrieved;
  }

  const std::map<int32_t, Trajectory>& truth_;
  PlaceRecognition recognition_{PlaceRecognitionOptions{}};
  // Every candidate is verified: none is redundant.
  static constexpr KnownConstraintOptions kVerifyAll{.min_gain_bits = 0};
  LoopVerifier intra_{LoopVerifierOptions{.alignment = {}, .drift = {}, .redundancy = kVerifyAll}};
  LoopVerifier inter_{LoopVerifierOptions{.alignment = {}, .drift = {}, .redundancy = kVerifyAll}};
  std::map<KeyframeId, Known> known_;
  Outcome outcome_;
};

// Empty if the place did not reach the stage.
std::optional<Scored> ScoredAt(const Retrieved& retrieved, size_t stage) {
  const bool right = retrieved.overlap >= kRightOverlap;
  const bool placed = retrieved.pnp_inliers >= LoopVerificationOptions{}.min_pnp_inliers;
  switch (stage) {
    case 0:
      return Scored{retrieved.query, retrieved.score, right, true};
    case 1:
      return Scored{retrieved.query, static_cast<double>(retrieved.epipolar_inliers), right,
                    retrieved.verified};
    case 2:
      return retrieved.published
                 ? std::optional(Scored{retrieved.query, static_cast<double>(retrieved.pnp_inliers),
                                        right, placed})
                 : std::nullopt;
    default:
      return retrieved.published && placed
                 ? std::optional(Scored{retrieved.query, static_cast<double>(retrieved.landmarks),
                                        retrieved.right_pose(), retrieved.accepted})
                 : std::nullopt;
  }
}

}  // namespace

bool Retrieved::right_pose() const {
  return landmarks > 0 && error_m <= kWrongTranslation_m && error_rad <= kWrongRotation_rad;
}

std::string ToString(Search search) { return search == Search::kOwnMap ? "own map" : "other maps"; }

Outcome RunStages(const std::vector<Keyframe>& keyframes,
                  const std::map<int32_t, Trajectory>& truth) {
  Stages stages(truth);
  for (const Keyframe& keyframe : keyframes) {
    stages.Add(keyframe);
  }
  return stages.Take();
}

std::vector<Scored> AtStage(const Outcome& outcome, Search search, size_t stage) {
  std::vector<Scored> scored;
  for (const Retrieved& retrieved : outcome.retrieved) {
    if ((retrieved.query.map == retrieved.match.map) == (search == Search::kOwnMap)) {
      if (const auto one = ScoredAt(retrieved, stage)) {
        scored.push_back(*one);
      }
    }
  }
  return scored;
}

}  // namespace pangea::bench
