// Tests the report's contents for two agents' maps: metrics, groups, poses.

#include "report/report.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "messages/channels.h"
#include "messages/messages.h"
#include "pangea/pose_t.hpp"
#include "pangea/status_t.hpp"
#include "report/report_test_world.h"

namespace pangea {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

using ReportTest = ReportWorld;

TEST_F(ReportTest, TwoAgentsFused) {
  LogBoth();
  LogConstraint(3, true, "");
  LogConstraint(3, true, "");  // a repeat
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
  EXPECT_EQ(agent["coverage"], 1.0);
  EXPECT_LT(agent["ate_server_m"].get<double>(), 1e-5);
  // 2 % of the path's extent
  EXPECT_GT(agent["ate_vio_m"].get<double>(), 0.02);
  EXPECT_LT(agent["ate_vio_m"].get<double>(), 0.08);
  EXPECT_EQ(agent["bytes_up"], 600'000);
  EXPECT_EQ(agent["bytes_down"], 2'000);
  EXPECT_NEAR(agent["kb_per_s_up"].get<double>(), 600.0 / 30, 0.1);
  EXPECT_EQ(agent["realtime_factor"], 1.0);
  EXPECT_TRUE(report["agents"][0]["link"].is_null());
  EXPECT_EQ(agent["link"]["conditions"], "loss 10 %");
  EXPECT_EQ(agent["link"]["packets_up"]["delivered"], 91);
  EXPECT_EQ(agent["link"]["packets_down"]["taken"], 7);
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
  // One agent is 0.1 m off the other; the joint alignment halves it, and rotates a little.
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

// A journal has the constraints, but not the fusions that they led to.
TEST_F(ReportTest, WithoutStatesTheFusionsAreUnknown) {
  LogKeyframes(Map(1), 0, NumKeyframes());
  LogKeyframes(Map(2), 0, NumKeyframes());
  LogConstraint(3, true, "");
  const json report = Report();
  EXPECT_THAT(report["notes"].dump(), HasSubstr("no MAP_STATE in this log"));
  EXPECT_THAT(markdown_, HasSubstr("Fusions are unknown"));
  EXPECT_THAT(markdown_, Not(HasSubstr("No maps were fused")));
  EXPECT_THAT(Text("report.html"), Not(HasSubstr("No maps were fused")));
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
  EXPECT_EQ(report["agents"][0]["coverage"], 1.0);
  EXPECT_NEAR(report["agents"][0]["initialised_s"].get<double>(), 2, 1e-6);
}

TEST_F(ReportTest, FewPosesAreNoted) {
  LogBoth();
  input_.agents[0].bus_log = folder_ + "/lost.lcm";
  {
    LogWriter log(input_.agents[0].bus_log);
    for (int i = 0; i < 130; ++i) {  // the start is not counted
      pose_t pose{};
      pose.utime = Utime(0.1 * i);
      pose.state = i < 30   ? pose_t::STATE_INITIALISING
                   : i < 85 ? pose_t::STATE_TRACKING
                            : pose_t::STATE_LOST;
      pose.map = ToMessage(Map(1));
      pose.T_odom_body = pose.T_map_body = ToMessage(Odometry(1, 0.1 * i));
      log.Write(channels::Pose(1), pose);
    }
    status_t status{};
    status.process = "vio_1";
    status.counters = {{"images_dropped", 10}};
    status.num_counters = 1;
    log.Write(channels::Status(status.process), status);
  }
  const json notes = Report()["notes"];
  EXPECT_THAT(notes, Contains(HasSubstr("agent 1: few poses: 55 of its 110 images after the start "
                                        "have one (50 %)")));
  EXPECT_THAT(notes.dump(), HasSubstr("10 were dropped"));
  EXPECT_THAT(notes.dump(), Not(HasSubstr("agent 2: few poses")));
  EXPECT_THAT(markdown_, HasSubstr("few poses: 55 of its 110 images"));
  EXPECT_THAT(Text("report.html"), HasSubstr("few poses: 55 of its 110 images"));
}

// As `start` and an anchor's `at` count it.
TEST_F(ReportTest, AChangeIsToldInTheTimeOfTheWholeRecording) {
  LogKeyframes(Map(1), 20, NumKeyframes());
  LogKeyframes(Map(2), 0, NumKeyframes());
  LogState(State(1, {Map(1), Map(2)}, 30));
  input_.agents[0].start_s = 10;
  fs::remove(input_.agents[0].bus_log);
  const json change = Report()["fused_at"].at(0);
  EXPECT_NEAR(change["recording_s"]["1"].get<double>(), Seconds(29), 1e-6);
  EXPECT_NEAR(change["recording_s"]["2"].get<double>(), Seconds(29), 0.051);
}

}  // namespace
}  // namespace pangea
