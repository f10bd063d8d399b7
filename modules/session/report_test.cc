#include "session/report.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <lcm/lcm-cpp.hpp>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "common/channels.h"
#include "common/messages.h"
#include "common/trajectory.h"
#include "pangea/pose_t.hpp"
#include "pangea/status_t.hpp"

namespace pangea::session {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::StartsWith;

constexpr int64_t kStart = 1'400'000'000'000'000;  // first image, microseconds
constexpr int64_t kOpened = 1'700'000'000'000'000;

class LogWriter {
 public:
  explicit LogWriter(const std::string& path) : log_(path, "w") {}

  template <typename Message>
  void Write(const std::string& channel, const Message& message) {
    std::vector<uint8_t> bytes(message.getEncodedSize());
    message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
    WriteBytes(channel, bytes);
  }
  void WriteBytes(const std::string& channel, std::vector<uint8_t> bytes) {
    lcm::LogEvent event;
    event.timestamp = utime_ += 100'000;
    event.channel = channel;
    event.data = bytes.data();
    event.datalen = static_cast<int32_t>(bytes.size());
    log_.writeEvent(&event);
  }

 private:
  lcm::LogFile log_;
  int64_t utime_ = kOpened;
};

// Where agent k's body is `s` seconds after its first image, in the ground truth's frame.
Rigid3 Truth(int32_t agent, double s) {
  return {ExpSo3({0.1 * std::sin(s), 0.1 * std::cos(s), 0.3 * s}),
          {2.0 * agent + 3 * std::cos(0.3 * s), 2 * std::sin(0.5 * s), 0.2 * std::sin(s)}};
}
Rigid3 OdomFromTruth(int32_t agent) { return {YawRotation(0.7 * agent), {4.0 * agent, -3, 1}}; }
// Scale drift of 2 %.
Rigid3 Odometry(int32_t agent, double s) {
  Rigid3 T = OdomFromTruth(agent) * Truth(agent, s);
  T.t *= 1.02;
  return T;
}

int64_t Utime(double s) { return kStart + std::llround(1e6 * s); }

class ReportTest : public ::testing::Test {
 protected:
  static constexpr double kDuration = 30;       // seconds of recording
  static constexpr double kInit = 2;            // first pose
  static constexpr double kCorrected = 12.025;  // what an agent shows, from here on exact
  static constexpr double kKeyframePeriod = 0.5;

  void SetUp() override {
    const auto* info = ::testing::UnitTest::GetInstance()->current_test_info();
    folder_ = ::testing::TempDir() + "pangea_report_" + info->name();
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
      input_.agents.push_back(run);
    }
    input_.server_log = folder_ + "/session.lcm";
    log_ = std::make_unique<LogWriter>(input_.server_log);
  }

  std::string Recording(int32_t agent) const { return fmt::format("{}/rec_{}", folder_, agent); }
  std::string AgentLog(int32_t agent) const { return fmt::format("{}/a{}.lcm", folder_, agent); }
  static MapId Map(int32_t agent, int nth = 0) {
    return {agent, kOpened + agent * int64_t{1000} + nth};
  }

  void WriteRecording(int32_t agent) const {
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

  void WriteAgentLog(int32_t agent) const {
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
  }

  static int NumKeyframes() { return static_cast<int>((kDuration - kInit) / kKeyframePeriod) + 1; }
  static double Seconds(int seq) { return kInit + kKeyframePeriod * seq; }

  static Keyframe MakeKeyframe(const MapId& map, int seq, double s) {
    Keyframe keyframe;
    keyframe.id = {map, seq};
    keyframe.utime = Utime(s);
    keyframe.camera.width = 100;
    keyframe.camera.height = 100;
    keyframe.camera.fx = keyframe.camera.fy = 100;
    keyframe.camera.cx = keyframe.camera.cy = 50;
    keyframe.T_odom_body = Odometry(map.agent_id, s);
    // A landmark that every keyframe sees straight ahead at 2 m, one of its own, an uncertain one.
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

  void LogKeyframes(const MapId& map, int begin, int end) {
    for (int seq = begin; seq < end; ++seq) {
      log_->Write(channels::Keyframe(map.agent_id),
                  ToMessage(MakeKeyframe(map, seq - begin, Seconds(seq))));
    }
  }
  void LogBoth() {
    LogKeyframes(Map(1), 0, NumKeyframes());
    LogKeyframes(Map(2), 0, NumKeyframes());
  }

  // Perfect poses in the odom frame of agent 1's map, but for a shift of each agent's.
  static MapState State(int64_t revision, const std::vector<MapId>& maps, int num_keyframes,
                        const Eigen::Vector3d& shift_of_second = Eigen::Vector3d::Zero()) {
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
  void LogState(const MapState& state) {
    for (const map_state_t& chunk : ToMessages(state)) {
      log_->Write("MAP_STATE", chunk);
    }
  }
  void LogConstraint(int seq, bool accepted, const std::string& reason) {
    Constraint constraint;
    constraint.from = {Map(1), seq};
    constraint.to = {Map(2), seq};
    constraint.accepted = accepted;
    constraint.reason = reason;
    constraint.T_from_to = Truth(1, Seconds(seq)).Inverse() * Truth(2, Seconds(seq));
    log_->Write("CONSTRAINT", ToMessage(constraint));
  }

  json Report() {
    log_.reset();
    markdown_ = WriteReport(input_, folder_ + "/out");
    return json::parse(Text("report.json"));
  }
  std::string Text(const std::string& file) const {
    std::ifstream in(folder_ + "/out/" + file, std::ios::binary);
    EXPECT_TRUE(in) << file;
    return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  }
  Trajectory Tum(const std::string& file) const {
    std::vector<std::string> warnings;
    return ReadTum(folder_ + "/out/" + file, &warnings);
  }
  bool Exists(const std::string& file) const { return fs::exists(folder_ + "/out/" + file); }
  static std::string Underscored(const MapId& map) {
    return fmt::format("{}_{}", map.agent_id, map.opened_utime);
  }

  std::string folder_;
  std::string markdown_;
  ReportInput input_;
  std::unique_ptr<LogWriter> log_;
};

TEST_F(ReportTest, TwoAgentsFused) {
  LogBoth();
  LogConstraint(3, true, "");
  LogConstraint(3, true, "");  // said again
  LogConstraint(4, false, "yaw of 31.5 deg is above the gate of 30 deg");
  LogConstraint(5, false, "yaw of 40 deg is above the gate of 30 deg");
  LogState(State(1, {Map(1), Map(2)}, 20));
  MapState final_state = State(2, {Map(1), Map(2)}, NumKeyframes(), {0.1, 0, 0});
  final_state.num_switched_off = 3;
  LogState(final_state);
  const json report = Report();

  const json& agent = report["agents"][1];
  EXPECT_EQ(agent["id"], 2);
  EXPECT_EQ(agent["map_ids"], json::array({fmt::format("2/{}", kOpened + 2000)}));
  EXPECT_EQ(agent["keyframes"], NumKeyframes());
  EXPECT_NEAR(agent["initialised_s"].get<double>(), kInit, 0.051);
  EXPECT_NEAR(agent["coverage"].get<double>(), 28.0 / 25.0, 1e-6);
  EXPECT_LT(agent["ate_server_m"].get<double>(), 1e-5);
  // 2 % of the path's extent
  EXPECT_GT(agent["ate_vio_m"].get<double>(), 0.02);
  EXPECT_LT(agent["ate_vio_m"].get<double>(), 0.08);
  EXPECT_EQ(agent["bytes_up"], 600'000);
  EXPECT_EQ(agent["bytes_down"], 2'000);
  EXPECT_NEAR(agent["kb_per_s_up"].get<double>(), 600.0 / 30, 0.1);
  EXPECT_EQ(agent["realtime_factor"], 1.0);
  EXPECT_LT(agent["ate_live_m"].get<double>(), 1e-5);
  EXPECT_GT(agent["ate_live_raw_m"].get<double>(), 0.02);
  EXPECT_LT(agent["live_jump_max_m"].get<double>(), 0.03) << "the odometry's 2 % of a step";
  EXPECT_GT(agent["live_jump_max_m"].get<double>(), 0);
  const Trajectory vio = Tum("agent_2.vio.tum");
  EXPECT_NEAR(agent["path_m"].get<double>(), PathLength(vio), 1e-4);
  EXPECT_NEAR(static_cast<double>(vio.size()), 28 * 20, 2);
  EXPECT_EQ(vio.front().utime, Utime(2));

  ASSERT_EQ(report["groups"].size(), 1U);
  EXPECT_EQ(report["groups"][0]["agents"], json::array({1, 2}));
  EXPECT_EQ(report["groups"][0]["map_ids"].size(), 2U);
  EXPECT_EQ(report["groups"][0]["constraints_switched_off"], 3);
  // One agent is 0.1 m off the other; the joint alignment halves it, and turns a little.
  EXPECT_NEAR(report["ate_joint_m"].get<double>(), 0.05, 0.01);
  EXPECT_EQ(report["groups"][0]["ate_joint_m"], report["ate_joint_m"]);
  EXPECT_EQ(report["constraints"]["accepted"], 1);
  EXPECT_EQ(report["constraints"]["refused"], 2);
  EXPECT_EQ(report["constraints"]["refused_by_reason"]["yaw of # deg is above the gate of # deg"],
            2);
  const json& truth = report["constraints_truth"];
  EXPECT_EQ(truth["checked"], 1);
  EXPECT_EQ(truth["wrong"], 0);
  EXPECT_EQ(truth["precision"], 1.0);
  EXPECT_LT(truth["nees_per_dim"]["mean"].get<double>(), 1e-6);
  EXPECT_EQ(truth["inter"]["checked"], 1);
  EXPECT_TRUE(truth["intra"]["precision"].is_null());
  EXPECT_TRUE(truth["intra"]["nees_yaw"].is_null());
  ASSERT_EQ(report["fused_at"].size(), 1U) << "the second state changes no group";
  EXPECT_EQ(report["fused_at"][0]["agents"], json::array({1, 2}));
  EXPECT_NEAR(report["fused_at"][0]["recording_s"]["2"].get<double>(), Seconds(19), 0.051);

  const Trajectory keyframes = Tum("agent_2.tum");
  ASSERT_EQ(keyframes.size(), static_cast<size_t>(NumKeyframes()));
  Rigid3 expected = OdomFromTruth(1) * Truth(2, Seconds(7));
  expected.t.x() += 0.1;
  EXPECT_LT(keyframes[7].T.Minus(expected).norm(), 1e-7) << "agent 2 in the frame of agent 1's map";
  EXPECT_EQ(keyframes[7].utime, Utime(Seconds(7)));

  for (const char* picture : {"trajectory.png", "error.png"}) {
    EXPECT_THAT(Text(picture), StartsWith("\x89PNG"));
  }
  EXPECT_THAT(markdown_, HasSubstr("yaw of # deg"));
  EXPECT_EQ(Text("report.md"), markdown_);
}

TEST_F(ReportTest, SameLogsSameBytes) {
  LogBoth();
  LogState(State(1, {Map(1), Map(2)}, 20));
  Report();
  std::map<std::string, std::string> first;
  for (const auto& entry : fs::directory_iterator(folder_ + "/out")) {
    first[entry.path().filename()] = Text(entry.path().filename());
  }
  EXPECT_EQ(first.size(), 9U);
  WriteReport(input_, folder_ + "/out");
  for (const auto& [file, bytes] : first) {
    EXPECT_EQ(Text(file), bytes) << file;
  }
}

TEST_F(ReportTest, UnfusedMapsAreGroupsOfTheirOwnWithTheOdometrysPoses) {
  LogBoth();
  const json report = Report();
  ASSERT_EQ(report["groups"].size(), 2U);
  EXPECT_EQ(report["groups"][0]["agents"], json::array({1}));
  EXPECT_EQ(report["groups"][1]["agents"], json::array({2}));
  EXPECT_EQ(report["fused_at"], json::array());
  EXPECT_LT(Tum("agent_2.tum")[5].T.Minus(Odometry(2, Seconds(5))).norm(), 1e-7);
  EXPECT_TRUE(Exists("map." + Underscored(Map(2)) + ".ply"));
  EXPECT_NEAR(report["agents"][0]["ate_server_m"].get<double>(),
              report["agents"][0]["ate_vio_m"].get<double>(), 0.01);
}

TEST_F(ReportTest, WithoutGroundTruthTheErrorsAreNullAndTheFilesStillCome) {
  for (const int32_t agent : {1, 2}) {
    fs::remove_all(Recording(agent) + "/mav0/state_groundtruth_estimate0");
  }
  LogBoth();
  LogState(State(1, {Map(1)}, 10));
  const json report = Report();
  for (const json& agent : report["agents"]) {
    EXPECT_TRUE(agent["ate_vio_m"].is_null());
    EXPECT_TRUE(agent["ate_server_m"].is_null());
    EXPECT_TRUE(agent["coverage"].is_null());
    EXPECT_NEAR(agent["initialised_s"].get<double>(), kInit, 0.051);
  }
  EXPECT_TRUE(report["ate_joint_m"].is_null());
  EXPECT_EQ(report["constraints_truth"]["checked"], 0);
  EXPECT_THAT(markdown_, HasSubstr("has no ground truth, so no error"));
  for (const std::string file : {"agent_1.tum", "agent_1.vio.tum", "agent_2.tum", "map.ply",
                                 "trajectory.png", "error.png"}) {
    EXPECT_TRUE(Exists(file)) << file;
  }
  EXPECT_TRUE(Exists("trajectory." + Underscored(Map(2)) + ".png"));
}

TEST_F(ReportTest, TheLogAloneIsEnough) {
  LogBoth();
  input_.agents.clear();
  const json report = Report();
  ASSERT_EQ(report["agents"].size(), 2U);
  EXPECT_TRUE(report["agents"][0]["bytes_up"].is_null());
  EXPECT_TRUE(report["agents"][0]["ate_live_m"].is_null());
  EXPECT_TRUE(report["agents"][0]["live_jump_max_m"].is_null());
  EXPECT_TRUE(report["agents"][0]["initialised_s"].is_null());
  EXPECT_EQ(Tum("agent_1.vio.tum").size(), static_cast<size_t>(NumKeyframes()));
  EXPECT_THAT(markdown_, HasSubstr("odometry is that of its keyframes"));
}

TEST_F(ReportTest, KeyframesBeyondTheSolveMoveWithItsLastPose) {
  LogBoth();
  LogState(State(1, {Map(1), Map(2)}, 20));
  Report();
  const Trajectory keyframes = Tum("agent_2.tum");
  ASSERT_EQ(keyframes.size(), static_cast<size_t>(NumKeyframes()));
  const Rigid3 T_map_odom =
      OdomFromTruth(1) * Truth(2, Seconds(19)) * Odometry(2, Seconds(19)).Inverse();
  EXPECT_LT(keyframes[30].T.Minus(T_map_odom * Odometry(2, Seconds(30))).norm(), 1e-6);
}

TEST_F(ReportTest, ASecondMapOfAnAgentHasFilesOfItsOwn) {
  LogKeyframes(Map(1), 0, 40);
  LogKeyframes(Map(1, 5), 40, NumKeyframes());
  LogKeyframes(Map(2), 0, NumKeyframes());
  LogState(State(4, {Map(1), Map(2)}, 40));
  const json report = Report();
  EXPECT_EQ(report["agents"][0]["map_ids"].size(), 2U);
  EXPECT_EQ(report["agents"][0]["keyframes"], NumKeyframes());
  EXPECT_EQ(Tum("agent_1.tum").size(), 40U);
  EXPECT_EQ(Tum("agent_1." + Underscored(Map(1, 5)) + ".tum").size(),
            static_cast<size_t>(NumKeyframes() - 40));
  EXPECT_LT(report["agents"][0]["coverage"].get<double>(), 0.8);
  EXPECT_THAT(markdown_, HasSubstr("| 1     | 2    |"));
}

TEST_F(ReportTest, TheNewestStateOfEachMapCountsAndAWrongFusionIsUndone) {
  LogBoth();
  LogState(State(1, {Map(1), Map(2)}, 20));
  LogState(State(2, {Map(1)}, NumKeyframes()));
  LogState(State(3, {Map(2)}, NumKeyframes()));
  const json report = Report();
  ASSERT_EQ(report["groups"].size(), 2U);
  ASSERT_EQ(report["fused_at"].size(), 2U);
  EXPECT_EQ(report["fused_at"][0]["change"], "fused");
  EXPECT_EQ(report["fused_at"][1]["change"], "taken apart");
  EXPECT_LT(Tum("agent_2.tum")[5].T.Minus(OdomFromTruth(2) * Truth(2, Seconds(5))).norm(), 1e-7);
}

TEST_F(ReportTest, ChunksAreJoinedAndAnIncompleteStateIsNotBelieved) {
  LogBoth();
  MapState state = State(5, {Map(1), Map(2)}, NumKeyframes());
  auto chunk = ToMessages(state).front();
  map_state_t half = chunk;
  half.num_chunks = 2;
  half.keyframes.resize(60);
  half.num_keyframes = 60;
  map_state_t other = chunk;
  other.num_chunks = 2;
  other.chunk = 1;
  other.keyframes.erase(other.keyframes.begin(), other.keyframes.begin() + 60);
  other.num_keyframes = static_cast<int16_t>(other.keyframes.size());
  log_->Write("MAP_STATE", other);
  log_->Write("MAP_STATE", half);
  half.revision = 6;
  log_->Write("MAP_STATE", half);
  const json report = Report();
  EXPECT_LT(report["ate_joint_m"].get<double>(), 1e-5);
  EXPECT_THAT(markdown_, HasSubstr("1 MAP_STATE lack a chunk"));
}

TEST_F(ReportTest, OnlyThePlayedPartOfTheGroundTruthCounts) {
  LogKeyframes(Map(1), 20, NumKeyframes());  // from 12 s on
  input_.agents[0].start_s = 10;
  input_.agents[0].duration_s = 20;
  fs::remove(input_.agents[0].bus_log);
  const json report = Report();
  EXPECT_NEAR(report["agents"][0]["coverage"].get<double>(), 18.0 / 15.0, 1e-3);
  EXPECT_NEAR(report["agents"][0]["initialised_s"].get<double>(), 2, 1e-6);
}

TEST_F(ReportTest, RubbishInTheLogIsCountedAndNamed) {
  LogBoth();
  log_->WriteBytes("KEYFRAME_1", {1, 2, 3});
  log_->WriteBytes("KEYFRAME_xyz", {1, 2, 3});
  const json report = Report();
  EXPECT_EQ(report["agents"].size(), 2U);
  EXPECT_THAT(markdown_, HasSubstr("1 messages on KEYFRAME_1 could not be read"));
}

TEST_F(ReportTest, ProcessesAndRestartsAreTold) {
  LogBoth();
  status_t status{};
  status.process = "fusion";
  status.messages_in = 7;
  counter_t refused{};
  refused.name = "too late";
  refused.count = 2;
  status.refused = {refused};
  status.num_refused = 1;
  log_->Write(channels::Status("fusion"), status);
  input_.realtime_factors["fusion"] = 3.5;
  input_.restarts["posegraph"] = 1;
  const json report = Report();
  EXPECT_EQ(report["processes"]["fusion"]["messages_in"], 7);
  EXPECT_EQ(report["processes"]["fusion"]["refused"]["too late"], 2);
  EXPECT_EQ(report["processes"]["fusion"]["realtime_factor"], 3.5);
  EXPECT_EQ(report["processes"]["posegraph"]["restarts"], 1);
  EXPECT_THAT(report["notes"], Contains(HasSubstr("posegraph died and was restarted")));
}

TEST_F(ReportTest, ThePointCloudIsColouredByAgentAndHasEachLandmarkOnce) {
  LogBoth();
  LogState(State(1, {Map(1), Map(2)}, NumKeyframes()));
  Report();
  const std::string ply = Text("map.ply");
  // Per agent one common landmark and one per keyframe; the uncertain ones are left out.
  EXPECT_THAT(ply, HasSubstr(fmt::format("element vertex {}\n", 2 * (1 + NumKeyframes()))));
  // The common landmark is best known from keyframe 0: 2 m ahead of it.
  const Eigen::Vector3d p = OdomFromTruth(1) * Truth(1, Seconds(0)) * Eigen::Vector3d(0, 0, 2);
  EXPECT_THAT(ply, HasSubstr(fmt::format("{:.4f} {:.4f} {:.4f} 0 114 178\n", p.x(), p.y(), p.z())));
  EXPECT_THAT(ply, HasSubstr(" 213 94 0\n"));
}

TEST_F(ReportTest, AnEmptyLogStillGivesAReport) {
  const json report = Report();
  EXPECT_EQ(report["groups"], json::array());
  EXPECT_EQ(report["agents"][0]["keyframes"], 0);
  EXPECT_TRUE(Exists("trajectory.png"));
  EXPECT_TRUE(Exists("agent_1.tum"));
}

TEST_F(ReportTest, WhatCannotBeDoneIsSaid) {
  EXPECT_THROW(WriteReport({.server_log = folder_ + "/absent.lcm"}, folder_), std::runtime_error);
  LogBoth();
  const std::string path = std::getenv("PATH");
  setenv("PATH", "/nonexistent", 1);
  const json report = Report();
  setenv("PATH", path.c_str(), 1);
  EXPECT_THAT(report["notes"], Contains(HasSubstr("install gnuplot-nox")));
  EXPECT_THROW(WriteReport(input_, folder_ + "/absent"), std::runtime_error);
}

}  // namespace
}  // namespace pangea::session
