#include "map_points/map_points_process.h"

#include <fmt/format.h>

#include <cstdlib>
#include <string>
#include <utility>

#include "common/catch_up_messages.h"
#include "common/channels.h"
#include "common/messages.h"

namespace pangea {
namespace {

constexpr int64_t kSecond = 1'000'000;

}  // namespace

MapPointsProcess::MapPointsProcess(Bus& bus, const MapPointsOptions& options)
    : node_(bus, "map_points"), points_(options) {
  node_.Subscribe<keyframe_t>(
      std::string(channels::kAllKeyframes),
      [this](const std::string&, const keyframe_t& message) { OnKeyframe(message); });
  node_.Subscribe<map_state_t>(
      std::string(channels::kMapState),
      [this](const std::string&, const map_state_t& message) { OnMapState(message); });
  node_.Subscribe<map_state_t>(
      std::string(channels::kRefinement),
      [this](const std::string&, const map_state_t& message) { OnRefinement(message); });
  node_.Subscribe<pose_t>(std::string(channels::kAllPoses),
                          [this](const std::string&, const pose_t& message) { OnPose(message); });
  node_.Subscribe<have_t>(std::string(channels::kHave),
                          [this](const std::string&, const have_t& message) { OnHave(message); });
  node_.Subscribe<again_t>(
      channels::Again(node_.name()),
      [this](const std::string&, const again_t& message) { OnAgain(message); });
}

void MapPointsProcess::OnKeyframe(const keyframe_t& message) {
  Parsed<Keyframe> parsed = Parse(message);
  if (!parsed.value) {
    node_.Refuse(parsed.refused);
    return;
  }
  keyframes_.Note(parsed.value->id.map, parsed.value->id.seq);
  points_.Take(std::move(*parsed.value));
}

void MapPointsProcess::OnMapState(const map_state_t& message) {
  Parsed<MapState> parsed = Parse(message);
  if (!parsed.value) {
    node_.Refuse(parsed.refused);
    return;
  }
  if (auto whole = states_.Add(message.chunk, message.num_chunks, std::move(*parsed.value))) {
    points_.Take(*whole);
  }
}

void MapPointsProcess::OnRefinement(const map_state_t& message) {
  Parsed<MapState> parsed = Parse(message);
  if (!parsed.value) {
    node_.Refuse(parsed.refused);
    return;
  }
  if (const auto whole =
          refinements_.Add(message.chunk, message.num_chunks, std::move(*parsed.value))) {
    points_.TakeRefined(*whole);
  }
}

void MapPointsProcess::OnPose(const pose_t& message) {
  const auto map = Parse(message.map);
  const auto T_odom_body = Parse(message.T_odom_body);
  const auto T_map_body = Parse(message.T_map_body);
  const Eigen::Vector3d v(message.v_odom_body.x, message.v_odom_body.y, message.v_odom_body.z);
  if (message.state != pose_t::STATE_TRACKING || message.group_revision < 1) {
    return;
  }
  constexpr double kMaxSpeed = 100;  // m/s
  constexpr int64_t kMaxUtime = 1LL << 60;
  if (!map.value || !T_odom_body.value || !T_map_body.value || !(v.norm() < kMaxSpeed) ||
      message.utime < 0 || message.utime > kMaxUtime) {
    node_.Refuse("pose: invalid map, pose, velocity or time");
    return;
  }
  const auto told = told_utime_.find(map.value->agent_id);
  if (told != told_utime_.end() && std::abs(message.utime - told->second) < kInterval_us) {
    return;
  }
  told_utime_[map.value->agent_id] = message.utime;
  const Eigen::Quaterniond q_map_odom = T_map_body.value->q * T_odom_body.value->q.conjugate();
  if (const auto landmarks = points_.Choose({*map.value, *T_map_body.value, q_map_odom * v})) {
    node_.Publish(channels::Landmarks(map.value->agent_id), ToMessage(*landmarks));
    node_.Count("landmarks", static_cast<int64_t>(landmarks->landmarks.size()));
  }
}

void MapPointsProcess::OnHave(const have_t& message) {
  const Parsed<Have> have = Parse(message);
  if (!have.value) {
    node_.Refuse(have.refused);
    return;
  }
  for (const auto& [map, highest_seq] : have.value->highest_seq) {
    keyframes_.Announce(map, highest_seq);
  }
  for (const SeqGap& gap : have.value->gaps) {
    keyframes_.Skip(gap);
  }
}

void MapPointsProcess::OnAgain(const again_t& message) {
  const bool known = TakeAgain<keyframe_t>(message, [this](const keyframe_t& m) { OnKeyframe(m); });
  if (!known) {
    node_.Refuse("again: not what was asked for");
  }
}

void MapPointsProcess::Tick(int64_t now_utime) {
  for (const SeqGap& gap : keyframes_.Due(now_utime)) {
    AskAgain(node_, channels::Keyframe(gap.map.agent_id), gap);
  }
  if (now_utime >= next_status_utime_) {
    next_status_utime_ = now_utime + kSecond;
    PublishStatus(now_utime);
  }
}

void MapPointsProcess::PublishStatus(int64_t now_utime) {
  node_.Set("keyframes_refined", static_cast<int64_t>(points_.num_refined()));
  node_.PublishStatus(now_utime, 0,
                      fmt::format("{} keyframes, {} of them bundle adjusted",
                                  points_.num_keyframes(), points_.num_refined()));
}

}  // namespace pangea
