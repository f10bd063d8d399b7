#include "map_points/map_points_process.h"

#include <fmt/format.h>

#include <cstdlib>
#include <functional>
#include <string>
#include <utility>

#include "bus/record_status.h"
#include "messages/channels.h"
#include "messages/messages.h"

namespace pangea {
namespace {

constexpr uint32_t kCheckpointFormat = 3;

}  // namespace

MapPointsProcess::MapPointsProcess(Bus& bus, const std::shared_ptr<RecordStore>& records,
                                   const CheckpointPlace& checkpoint)
    : node_(bus, "map_points"),
      records_(std::make_shared<JournalRecords>(records, MapPoints::RecordOf)),
      points_(records_),
      journal_(node_, {.states = true},
               {.keyframe = [this](Keyframe keyframe) { points_.Take(std::move(keyframe)); }},
               {.place = checkpoint,
                .format = kCheckpointFormat,
                .save = std::bind_front(&MapPoints::Save, &points_),
                .restore = std::bind_front(&MapPoints::Restore, &points_)},
               records_) {
  node_.Listen<map_state_t>(channels::kMapState,
                            std::bind_front(&MapPointsProcess::OnMapState, this));
  node_.Listen<map_state_t>(channels::kRefinement,
                            std::bind_front(&MapPointsProcess::OnRefinement, this));
  node_.Subscribe<pose_t>(std::string(channels::kAllPoses),
                          [this](const std::string&, const pose_t& message) { OnPose(message); });
}

void MapPointsProcess::OnMapState(MapState state, const map_state_t& message) {
  if (auto whole = states_.Add(message.chunk, message.num_chunks, std::move(state))) {
    if (!journal_.reading()) {  // else they are asked for all the same, to get the refinement
      journal_.NoteStates(whole->maps);
    }
    points_.Take(*whole);
  }
}

void MapPointsProcess::OnRefinement(MapState state, const map_state_t& message) {
  if (const auto whole = refinements_.Add(message.chunk, message.num_chunks, std::move(state))) {
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
  const auto sent_points = sent_utime_.find(map.value->agent_id);
  if (sent_points != sent_utime_.end() &&
      std::abs(message.utime - sent_points->second) < kInterval_us) {
    return;
  }
  sent_utime_[map.value->agent_id] = message.utime;
  const Eigen::Quaterniond q_map_odom = T_map_body.value->q * T_odom_body.value->q.conjugate();
  if (const auto landmarks = points_.Choose({*map.value, *T_map_body.value, q_map_odom * v})) {
    node_.Publish(channels::Landmarks(map.value->agent_id), ToMessage(*landmarks));
    node_.Count("landmarks", static_cast<int64_t>(landmarks->landmarks.size()));
  }
}

void MapPointsProcess::Tick(int64_t now_utime) {
  journal_.Tick(now_utime);
  if (node_.StatusIsDue(now_utime)) {
    PublishStatus(now_utime);
  }
}

void MapPointsProcess::PublishStatus(int64_t now_utime) {
  node_.Set("keyframes_refined", static_cast<int64_t>(points_.num_refined()));
  node_.PublishStatus(now_utime, 0,
                      fmt::format("{} keyframes, {} of them bundle adjusted{}",
                                  points_.num_keyframes(), points_.num_refined(),
                                  NoteRecords(points_.store_counters(), records_.get(), &node_)));
}

}  // namespace pangea
