#include "report/metrics/report_anchors.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "eval/metrics.h"
#include "report/metrics/group_history.h"

namespace pangea {
namespace {

// Largest gap between the poses around a placement, and between frames for a jump.
constexpr int64_t kMaxPoseGap_us = 1'000'000;
constexpr double kErrorWidth_px = 640;

// An edit with a placement, and the true position that follows from it.
struct Placing {
  int64_t revision = 0;  // valid from this revision on
  MapId map;
  int64_t utime = 0;
  std::optional<Rigid3> T_odom_body = {};  // from the edit
  std::optional<Eigen::Vector3d> p_truth = {};
  std::string reason = {};  // why there is no p_truth
  std::optional<AnchorView> view = {};
};

bool IsAllowed(const AnchorEdit& edit) {
  return edit.right != AnchorRight::kRead &&
         (edit.right != AnchorRight::kEditOwn || edit.agent_id == edit.anchor.agent_id);
}

// The edits with a placement by revision; of equal revisions the one of the highest agent.
std::map<int64_t, AnchorEdit> InForce(const std::vector<AnchorEdit>& edits) {
  std::map<int64_t, AnchorEdit> in_force;
  for (const AnchorEdit& edit : edits) {
    if (IsAllowed(edit)) {
      const auto [known, inserted] = in_force.try_emplace(edit.revision, edit);
      if (!inserted && known->second.agent_id <= edit.agent_id) {
        known->second = edit;
      }
    }
  }
  return in_force;
}

// The anchor in one frame of an agent.
struct Sighting {
  const AnchorFrame* frame = nullptr;
  int64_t revision = 0;
  Rigid3 T_odom_anchor;
};
using Sightings = std::map<AnchorId, std::vector<Sighting>>;

Sightings SightingsOf(const AnchorTrack& track) {
  Sightings sightings;
  for (const AnchorFrame& frame : track.frames) {
    if (frame.shown->map == frame.map) {
      for (const ShownAnchor& shown : frame.shown->anchors) {
        sightings[shown.anchor].push_back({&frame, shown.revision, shown.T_odom_anchor});
      }
    }
  }
  return sightings;
}

// Interpolates between the two poses around the time; else the nearest one within about a frame.
std::optional<Rigid3> PoseAt(const Trajectory& poses, int64_t utime) {
  if (auto between = Interpolate(poses, utime, kMaxPoseGap_us)) {
    return between;
  }
  const auto off = [utime](const StampedPose& pose) { return std::abs(pose.utime - utime); };
  const auto nearest = std::ranges::min_element(poses, {}, off);
  if (nearest != poses.end() && off(*nearest) <= kMaxGroundTruthGapUs) {
    return nearest->T;
  }
  return std::nullopt;
}

std::optional<Rigid3> TruthAt(const AnchorViewer& viewer, int64_t utime) {
  return Interpolate(*viewer.ground_truth, utime, kMaxGroundTruthGapUs);
}

// Evaluates the anchors of one session.
class Evaluation {
 public:
  Evaluation(const CapturedSession& session, const std::vector<AnchorViewer>& viewers)
      : session_(session), groups_(session) {
    for (const AnchorViewer& viewer : viewers) {
      viewers_[viewer.agent] = &viewer;
      sightings_[viewer.agent] = SightingsOf(*viewer.track);
    }
  }

  AnchorMetrics Of(const AnchorId& id, const std::map<int64_t, AnchorEdit>& edits) const {
    AnchorMetrics metrics;
    metrics.id = id;
    metrics.made_by = id.agent_id;
    metrics.name = edits.rbegin()->second.name;
    metrics.placed =
        session_.anchors_placed.contains(id) ||
        std::ranges::any_of(viewers_, [&](const auto& viewer) {
          const auto heard = viewer.second->track->heard.find(id);
          return heard != viewer.second->track->heard.end() &&
                 std::ranges::any_of(heard->second, [](const HeardAnchor& h) { return !h.gone; });
        });
    const std::vector<Placing> placings = PlacingsOf(id, edits);
    if (!placings.empty()) {
      metrics.placing = placings.front().view;
      for (const int32_t agent : groups_.AgentsWith(placings.back().map)) {
        if (agent != id.agent_id) {
          metrics.agents.push_back(AtAgent(id, placings, agent));
        }
      }
    }
    return metrics;
  }

 private:
  std::vector<Placing> PlacingsOf(const AnchorId& id,
                                  const std::map<int64_t, AnchorEdit>& edits) const {
    std::vector<Placing> placings;
    for (const auto& [revision, edit] : edits) {
      int64_t utime = edit.utime;
      if (edit.placement == AnchorEdit::Placement::kKeyframe) {
        const auto keyframe = session_.keyframes.find({edit.map, edit.keyframe_seq});
        utime = keyframe == session_.keyframes.end() ? 0 : keyframe->second.utime;
      }
      if (edit.placement != AnchorEdit::Placement::kSame && !edit.deleted) {
        placings.push_back({revision, edit.map, utime, edit.T_odom_body});
      }
    }
    for (size_t i = 0; i < placings.size(); ++i) {
      const int64_t until =
          i + 1 < placings.size() ? placings[i + 1].revision : std::numeric_limits<int64_t>::max();
      placings[i].reason = FindTruth(id, until, &placings[i]);
    }
    return placings;
  }

  // Returns why the truth is unknown, or an empty string. `until`: the next revision with a
  // placement.
  std::string FindTruth(const AnchorId& id, int64_t until, Placing* placing) const {
    const int32_t agent = placing->map.agent_id;
    const auto maker = viewers_.find(agent);
    if (maker == viewers_.end() || maker->second->ground_truth->empty()) {
      return fmt::format("agent {} has no ground truth", agent);
    }
    const AnchorViewer& viewer = *maker->second;
    if (!viewer.recording_maps->contains(placing->map)) {
      return fmt::format("agent {} placed it in a map of another recording", agent);
    }
    const std::optional<HeardAnchor> heard = FirstHeard(viewer, id, until, *placing);
    if (!heard) {
      return fmt::format("agent {} has not heard where it is", agent);
    }
    const auto odometry = viewer.odometry->find(placing->map);
    const auto T_odom_body = placing->T_odom_body || odometry == viewer.odometry->end()
                                 ? placing->T_odom_body
                                 : PoseAt(odometry->second, placing->utime);
    const auto T_truth_body = TruthAt(viewer, placing->utime);
    if (!T_odom_body || !T_truth_body) {
      return fmt::format("agent {} has no {} at its placing", agent,
                         T_odom_body ? "ground truth" : "pose");
    }
    const Rigid3 T_body_anchor = T_odom_body->Inverse() * heard->T_odom_anchor;
    placing->p_truth = *T_truth_body * T_body_anchor.t;
    if (const auto camera = session_.cameras.find(agent); camera != session_.cameras.end()) {
      placing->view = {agent, placing->utime, camera->second.T_body_cam.Inverse() * T_body_anchor,
                       std::nullopt};
    }
    return "";
  }

  static std::optional<HeardAnchor> FirstHeard(const AnchorViewer& viewer, const AnchorId& id,
                                               int64_t until, const Placing& placing) {
    const auto heard = viewer.track->heard.find(id);
    if (heard == viewer.track->heard.end()) {
      return std::nullopt;
    }
    const auto first = std::ranges::find_if(heard->second, [&](const HeardAnchor& h) {
      return !h.gone && h.map == placing.map && h.revision >= placing.revision &&
             h.revision < until;
    });
    return first == heard->second.end() ? std::nullopt : std::optional(*first);
  }

  AnchorAtAgent AtAgent(const AnchorId& id, const std::vector<Placing>& placings,
                        int32_t agent) const;

  const CapturedSession& session_;
  GroupHistory groups_;
  std::map<int32_t, const AnchorViewer*> viewers_;
  std::map<int32_t, Sightings> sightings_;
};

// The placement valid at a revision; null before the first.
const Placing* InForceAt(const std::vector<Placing>& placings, int64_t revision) {
  const auto after = std::ranges::upper_bound(placings, revision, {}, &Placing::revision);
  return after == placings.begin() ? nullptr : &*std::prev(after);
}

double LargestJump(const std::vector<Sighting>& sightings, const std::vector<Placing>& placings) {
  double largest = 0;
  for (size_t i = 1; i < sightings.size(); ++i) {
    const Sighting& before = sightings[i - 1];
    const Sighting& now = sightings[i];
    if (now.frame->map == before.frame->map &&
        now.frame->utime - before.frame->utime <= kMaxPoseGap_us &&
        InForceAt(placings, now.revision) == InForceAt(placings, before.revision)) {
      largest = std::max(largest, (now.T_odom_anchor.t - before.T_odom_anchor.t).norm());
    }
  }
  return largest;
}

// The pose in the newest ANCHOR_k at that frame.
std::optional<Rigid3> Unblended(const std::vector<HeardAnchor>& heard, const AnchorFrame& frame) {
  const auto after = std::ranges::upper_bound(heard, frame.log_utime, {}, &HeardAnchor::log_utime);
  if (after == heard.begin() || std::prev(after)->gone || std::prev(after)->map != frame.map) {
    return std::nullopt;
  }
  return std::prev(after)->T_odom_anchor;
}

// If the anchor should be visible but cannot be projected: the image's diagonal.
double PixelError(const CameraModel& camera, const Eigen::Vector3d& p_shown,
                  const Eigen::Vector3d& p_truth) {
  const auto shown = p_shown.z() > 0 ? camera.Project(p_shown) : std::nullopt;
  return kErrorWidth_px / camera.width *
         (shown ? (*shown - *camera.Project(p_truth)).norm()
                : std::hypot(camera.width, camera.height));
}

std::optional<double> Median(const std::vector<double>& values) {
  return values.empty() ? std::nullopt : std::optional(StatisticsOf(values).median);
}

// Errors of one anchor at one agent, frame by frame.
class Errors {
 public:
  Errors(const AnchorViewer& viewer, const CameraModel* camera, int64_t fused_utime)
      : viewer_(viewer), camera_(camera), fused_utime_(fused_utime) {}

  void Add(const Sighting& sighting, const Eigen::Vector3d& p_truth,
           const std::vector<HeardAnchor>& heard) {
    const AnchorFrame& frame = *sighting.frame;
    const auto T_truth_body = TruthAt(viewer_, frame.utime);
    if (!T_truth_body || frame.log_utime < fused_utime_) {
      return;
    }
    const Eigen::Vector3d p_body_truth = T_truth_body->Inverse() * p_truth;
    const auto error_of = [&](const Rigid3& T_odom_anchor) {
      return (frame.T_odom_body.Inverse() * T_odom_anchor.t - p_body_truth).norm();
    };
    const double error = error_of(sighting.T_odom_anchor);
    first_ = first_.value_or(error);
    last_ = error;
    if (frame.log_utime < fused_utime_ + kAnchorSettled_us) {
      return;
    }
    settled_.push_back(error);
    if (const auto T_odom_anchor = Unblended(heard, frame)) {
      unblended_.push_back(error_of(*T_odom_anchor));
    }
    AddPixels(sighting, p_body_truth);
  }

  void WriteTo(AnchorAtAgent* at) const {
    at->error_at_fusion_m = first_;
    at->error_end_m = last_;
    at->error_m = Median(settled_);
    at->error_px = Median(pixels_);
    at->error_unblended_m = Median(unblended_);
    if (!settled_.empty()) {
      at->error_10s_m = settled_.front();
      at->error_max_m = *std::ranges::max_element(settled_);
    }
    at->view = view_;
  }

 private:
  void AddPixels(const Sighting& sighting, const Eigen::Vector3d& p_body_truth) {
    if (camera_ == nullptr) {
      return;
    }
    const Rigid3 T_cam_body = camera_->T_body_cam.Inverse();
    const Eigen::Vector3d p_truth = T_cam_body * p_body_truth;
    const auto inside = Inside(*camera_, p_truth);
    if (!inside) {
      return;
    }
    const Rigid3 T_cam_anchor =
        T_cam_body * sighting.frame->T_odom_body.Inverse() * sighting.T_odom_anchor;
    pixels_.push_back(PixelError(*camera_, T_cam_anchor.t, p_truth));
    if (*inside > best_inside_) {
      best_inside_ = *inside;
      view_ = {viewer_.agent, sighting.frame->utime, T_cam_anchor, p_truth};
    }
  }

  const AnchorViewer& viewer_;
  const CameraModel* camera_;
  const int64_t fused_utime_;
  std::optional<double> first_, last_;
  std::vector<double> settled_, unblended_, pixels_;
  double best_inside_ = -1;
  std::optional<AnchorView> view_;
};

AnchorAtAgent Evaluation::AtAgent(const AnchorId& id, const std::vector<Placing>& placings,
                                  int32_t agent) const {
  AnchorAtAgent at;
  at.agent = agent;
  const auto viewer = viewers_.find(agent);
  const auto of_agent = sightings_.find(agent);
  if (of_agent == sightings_.end() || !of_agent->second.contains(id)) {
    at.reason = fmt::format("agent {} has not shown it", agent);
    return at;
  }
  const std::vector<Sighting>& sightings = of_agent->second.at(id);
  at.largest_jump_m = LargestJump(sightings, placings);
  const auto camera = session_.cameras.find(agent);
  const std::vector<HeardAnchor> none;
  const auto heard = viewer->second->track->heard.find(id);
  Errors errors(*viewer->second, camera == session_.cameras.end() ? nullptr : &camera->second,
                groups_.TogetherSince(placings.back().map, agent).value_or(0));
  for (const Sighting& sighting : sightings) {
    const Placing* placing = InForceAt(placings, sighting.revision);
    if (placing == nullptr || !placing->p_truth) {
      at.reason = placing == nullptr ? "its placing is not in the log" : placing->reason;
    } else {
      errors.Add(sighting, *placing->p_truth,
                 heard == viewer->second->track->heard.end() ? none : heard->second);
    }
  }
  errors.WriteTo(&at);
  if (at.error_m) {
    at.reason.clear();
  } else if (viewer->second->ground_truth->empty()) {
    at.reason = fmt::format("agent {} has no ground truth", agent);
  } else if (at.reason.empty()) {
    at.reason = fmt::format("agent {} has not shown it from 10 s after the fusion on", agent);
  }
  return at;
}

}  // namespace

std::optional<double> Inside(const CameraModel& camera, const Eigen::Vector3d& p_cam) {
  const auto pixel = p_cam.z() > 0 ? camera.Project(p_cam) : std::nullopt;
  if (!pixel || !camera.Contains(*pixel)) {
    return std::nullopt;
  }
  return std::min(
      {pixel->x(), pixel->y(), camera.width - 1 - pixel->x(), camera.height - 1 - pixel->y()});
}

std::vector<AnchorMetrics> AnchorsOf(const CapturedSession& session,
                                     const std::vector<AnchorViewer>& viewers,
                                     const std::vector<WantedAnchor>& wanted) {
  std::map<AnchorId, std::vector<AnchorEdit>> edits = session.anchor_edits;
  for (const AnchorViewer& viewer : viewers) {
    for (const auto& [id, request] : viewer.track->requests) {
      edits.try_emplace(id, std::vector{request});  // the server never received it
    }
  }
  const Evaluation evaluation(session, viewers);
  std::vector<AnchorMetrics> anchors;
  std::set<std::pair<int32_t, std::string>> known;
  for (const auto& [id, of_anchor] : edits) {
    if (const auto in_force = InForce(of_anchor); !in_force.empty()) {
      anchors.push_back(evaluation.Of(id, in_force));
      known.emplace(id.agent_id, in_force.begin()->second.name);
    }
  }
  for (const WantedAnchor& one : wanted) {
    if (!known.contains({one.agent, one.name})) {
      AnchorMetrics& missing = anchors.emplace_back();
      missing.name = one.name;
      missing.made_by = one.agent;
    }
  }
  return anchors;
}

}  // namespace pangea
