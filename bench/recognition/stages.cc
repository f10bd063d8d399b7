#include "bench/recognition/stages.h"

#include <algorithm>
#include <optional>
#include <set>

#include "bench/recognition/overlap.h"
#include "eval/metrics.h"
#include "fusion/fusion.h"
#include "inter_map_ba/inter_map_ba.h"
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
        outcome_.looked.push_back(Follow(*query, other->second, place, match));
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

  // As place recognition has it: what odometry still connects is no place seen again.
  bool IsRecent(const Known& query, const Known& other) const {
    return query.id.seq - other.id.seq < options_.min_seq_gap ||
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

  Looked Follow(const Known& query, const Known& other, const PlaceReport& place,
                const PlaceMatch& match) {
    Looked looked{.query = query.id, .match = other.id};
    looked.overlap = Overlap(query.view, other.view);
    looked.score = place.score;
    looked.epipolar_inliers = place.inliers;
    looked.verified = place.verified;
    const auto candidate =
        std::find_if(match.candidates.begin(), match.candidates.end(),
                     [&](const PlaceCandidate& c) { return c.match == other.id; });
    looked.published = candidate != match.candidates.end();
    if (!looked.published) {
      return looked;
    }
    PairJudge& judge = candidate->kind == PlaceKind::kIntra ? static_cast<PairJudge&>(intra_)
                                                            : static_cast<PairJudge&>(inter_);
    AlignmentReport report;
    const Constraint constraint = judge.Judge(query.id, *candidate, &report);
    looked.pnp_inliers = report.pnp_inliers;
    looked.landmarks = report.landmarks;
    looked.accepted = constraint.accepted;
    if (looked.landmarks > 0) {
      const Vector6d error =
          constraint.T_from_to.Minus(other.T_reference_body.Inverse() * query.T_reference_body);
      looked.error_m = error.head<3>().norm();
      looked.error_rad = error.tail<3>().norm();
    }
    return looked;
  }

  const std::map<int32_t, Trajectory>& truth_;
  PlaceRecognitionOptions options_;
  PlaceRecognition recognition_{options_};
  InterMapBa intra_{InterMapBaOptions{}};
  Fusion inter_{FusionOptions{}};
  std::map<KeyframeId, Known> known_;
  Outcome outcome_;
};

// Nothing for what did not come to the stage.
std::optional<Judged> JudgedAt(const Looked& looked, size_t stage) {
  const bool right = looked.overlap >= kRightOverlap;
  const bool placed = looked.pnp_inliers >= AlignmentOptions{}.min_pnp_inliers;
  switch (stage) {
    case 0:
      return Judged{looked.query, looked.score, right, true};
    case 1:
      return Judged{looked.query, static_cast<double>(looked.epipolar_inliers), right,
                    looked.verified};
    case 2:
      return looked.published
                 ? std::optional(
                       Judged{looked.query, static_cast<double>(looked.pnp_inliers), right, placed})
                 : std::nullopt;
    default:
      return looked.published && placed
                 ? std::optional(Judged{looked.query, static_cast<double>(looked.landmarks),
                                        looked.right_pose(), looked.accepted})
                 : std::nullopt;
  }
}

}  // namespace

bool Looked::right_pose() const {
  return landmarks > 0 && error_m <= session::kWrongTranslation_m &&
         error_rad <= session::kWrongRotation_rad;
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

std::vector<Judged> AtStage(const Outcome& outcome, Search search, size_t stage) {
  std::vector<Judged> judged;
  for (const Looked& looked : outcome.looked) {
    if ((looked.query.map == looked.match.map) == (search == Search::kOwnMap)) {
      if (const auto one = JudgedAt(looked, stage)) {
        judged.push_back(*one);
      }
    }
  }
  return judged;
}

}  // namespace pangea::bench
