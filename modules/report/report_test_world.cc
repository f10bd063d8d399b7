#include "report/report_test_world.h"

#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "messages/channels.h"
#include "messages/messages.h"
#include "pangea/pose_t.hpp"
#include "pangea/status_t.hpp"

namespace pangea {

namespace fs = std::filesystem;

void LogWriter::WriteBytes(const std::string& channel, Bytes bytes) {
  log_.Write(utime_ += 100'000, channel, bytes);
}

Rigid3 Truth(int32_t agent, double s) {
  return {ExpSo3({0.1 * std::sin(s), 0.1 * std::cos(s), 0.3 * s}),
          {2.0 * agent + 3 * std::cos(0.3 * s), 2 * std::sin(0.5 * s), 0.2 * std::sin(s)}};
}

Rigid3 OdomFromTruth(int32_t agent) { return {YawRotation(0.7 * agent), {4.0 * agent, -3, 1}}; }

Rigid3 Odometry(int32_t agent, double s) {
  Rigid3 T = OdomFromTruth(agent) * Truth(agent, s);
  T.t *= 1.02;
  return T;
}

int64_t Utime(double s) { return kStart + std::llround(1e6 * s); }

void ReportWorld::SetUp() {
  const auto* info = ::testing::UnitTest::GetInstance()->current_test_info();
  folder_ =
      fmt::format("{}pangea_{}_{}", ::testing::TempDir(), info->test_suite_name(), info->name());
  fs::remove_all(folder_);
  fs::create_directories(folder_ + "/out");
  for (const int32_t agent : {1, 2}) {
    WriteRecording(agent);
    WriteAgentLog(agent);
    AgentRun run;
    run.id = agent;
    run.recording = Recording(agent);
    run.bus_log = AgentLog(agent);
    run.bytes_up = 300'000 * agent;
    run.bytes_down = 2'000;
    run.realtime_factor = 1.0;
    if (agent == 2) {
      run.link = LinkRun{"loss 10 %", {{"taken", 100}, {"delivered", 91}}, {{"taken", 7}}};
    }
    input_.agents.push_back(run);
  }
  input_.server_log = folder_ + "/session.lcm";
  log_ = std::make_unique<LogWriter>(input_.server_log);
}

std::string ReportWorld::Recording(int32_t agent) const {
  return fmt::format("{}/rec_{}", folder_, agent);
}

std::string ReportWorld::AgentLog(int32_t agent) const {
  return fmt::format("{}/a{}.lcm", folder_, agent);
}

std::string ReportWorld::Underscored(const MapId& map) {
  return fmt::format("{}_{}", map.agent_id, map.opened_utime);
}

void ReportWorld::WriteRecording(int32_t agent) const {
  const std::string mav0 = Recording(agent) + "/mav0";
  fs::create_directories(mav0 + "/cam0");
  fs::create_directories(mav0 + "/imu0");
  fs::create_directories(mav0 + "/state_groundtruth_estimate0");
  std::ofstream(mav0 + "/cam0/data.csv") << fmt::format("#t\n{0}000,{0}000.png\n", kStart);
  std::ofstream truth(mav0 + "/state_groundtruth_estimate0/data.csv");
  for (int i = 0; i <= 3000; ++i) {
    const Rigid3 T = Truth(agent, 0.01 * i);
    truth << fmt::format("{}000,{:.9f},{:.9f},{:.9f},{:.9f},{:.9f},{:.9f},{:.9f}\n",
                         Utime(0.01 * i), T.t.x(), T.t.y(), T.t.z(), T.q.w(), T.q.x(), T.q.y(),
                         T.q.z());
  }
}

void ReportWorld::WriteAgentLog(int32_t agent) const {
  LogWriter log(AgentLog(agent));
  for (double s = 0; s <= kDuration; s += 0.05) {
    pose_t pose{};
    pose.utime = Utime(s);
    pose.state = s < kInit ? pose_t::STATE_INITIALISING : pose_t::STATE_TRACKING;
    pose.map = ToMessage(Map(agent));
    pose.T_odom_body = ToMessage(Odometry(agent, s));
    pose.T_map_body = pose.T_odom_body;
    if (s >= kCorrected) {
      pose.T_map_body = ToMessage(OdomFromTruth(1) * Truth(agent, s));
      pose.group_revision = 1;
    }
    log.Write(channels::Pose(agent), pose);
  }
  Correction correction;
  correction.map = Map(agent);
  correction.group = Map(1);
  correction.revision = 1;
  log.Write(channels::Correction(agent), ToMessage(correction));
  for (const int64_t bytes : {0, 250'000}) {
    status_t status{};
    status.process = fmt::format("uplink_{}", agent);
    status.counters = {{"bytes_up", bytes}, {"bytes_down", 900}};
    status.num_counters = 2;
    log.Write(channels::Status(status.process), status);
  }
}

Keyframe ReportWorld::MakeKeyframe(const MapId& map, int seq, double s, int32_t walk) {
  Keyframe keyframe;
  keyframe.id = {map, seq};
  keyframe.utime = Utime(s);
  keyframe.camera.width = 100;
  keyframe.camera.height = 100;
  keyframe.camera.fx = keyframe.camera.fy = 100;
  keyframe.camera.cx = keyframe.camera.cy = 50;
  keyframe.T_odom_body = Odometry(walk, s);
  // A landmark that every keyframe sees straight ahead at 2 m, one seen only by it, an uncertain
  // one.
  for (const int32_t landmark : {0, 1 + seq, 10'000 + seq}) {
    Corner corner;
    corner.pixel = {50, 50};
    corner.landmark_id = landmark;
    keyframe.corners.push_back(corner);
  }
  keyframe.points = {
      {0, 0.5F, 1e-4F * static_cast<float>(1 + seq)}, {1, 0.25F, 1e-4F}, {2, 0.25F, 1e-1F}};
  return keyframe;
}

void ReportWorld::LogKeyframes(const MapId& map, int begin, int end, int32_t walk) {
  for (int seq = begin; seq < end; ++seq) {
    log_->Write(
        channels::Keyframe(map.agent_id),
        ToMessage(MakeKeyframe(map, seq - begin, Seconds(seq), walk == 0 ? map.agent_id : walk)));
  }
}

void ReportWorld::LogBoth() {
  LogKeyframes(Map(1), 0, NumKeyframes());
  LogKeyframes(Map(2), 0, NumKeyframes());
}

MapState ReportWorld::State(int64_t revision, const std::vector<MapId>& maps, int num_keyframes,
                            const Eigen::Vector3d& shift_of_second) {
  MapState state;
  state.group = maps.front();
  state.revision = revision;
  state.maps = maps;
  for (const MapId& map : maps) {
    for (int seq = 0; seq < num_keyframes; ++seq) {
      Rigid3 T = OdomFromTruth(maps.front().agent_id) * Truth(map.agent_id, Seconds(seq));
      T.t += map.agent_id == 2 ? shift_of_second : Eigen::Vector3d::Zero();
      state.keyframes.push_back({{map, seq}, Utime(Seconds(seq)), T});
    }
  }
  return state;
}

void ReportWorld::LogState(const MapState& state) {
  for (const map_state_t& chunk : ToMessages(state)) {
    log_->Write(std::string(channels::kMapState), chunk);
  }
}

void ReportWorld::LogConstraint(int seq, bool accepted, const std::string& reason) {
  Constraint constraint;
  constraint.from = {Map(1), seq};
  constraint.to = {Map(2), seq};
  constraint.accepted = accepted;
  constraint.reason = reason;
  constraint.T_from_to = Truth(1, Seconds(seq)).Inverse() * Truth(2, Seconds(seq));
  log_->Write(std::string(channels::kConstraint), ToMessage(constraint));
}

nlohmann::json ReportWorld::Report() {
  log_.reset();
  markdown_ = WriteReport(input_, folder_ + "/out").text;
  return nlohmann::json::parse(Text("report.json"));
}

std::string ReportWorld::Text(const std::string& file) const {
  std::ifstream in(folder_ + "/out/" + file, std::ios::binary);
  EXPECT_TRUE(in) << file;
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

Trajectory ReportWorld::Tum(const std::string& file) const {
  std::vector<std::string> warnings;
  return ReadTum(folder_ + "/out/" + file, &warnings);
}

bool ReportWorld::Exists(const std::string& file) const {
  return fs::exists(folder_ + "/out/" + file);
}

}  // namespace pangea
