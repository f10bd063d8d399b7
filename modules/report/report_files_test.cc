// Tests the files that the report writes, also if something is missing or damaged, and its messages
// about that.

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>

#include "messages/channels.h"
#include "pangea/status_t.hpp"
#include "report/report.h"
#include "report/report_test_world.h"

namespace pangea {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using ::testing::Contains;
using ::testing::HasSubstr;

using ReportFilesTest = ReportWorld;

TEST_F(ReportFilesTest, SameLogsSameBytes) {
  LogBoth();
  LogState(State(1, {Map(1), Map(2)}, 20));
  Report();
  std::map<std::string, std::string> first;
  for (const auto& entry : fs::directory_iterator(folder_ + "/out")) {
    first[entry.path().filename()] = Text(entry.path().filename());
  }
  EXPECT_EQ(first.size(), 10U);
  WriteReport(input_, folder_ + "/out");
  for (const auto& [file, bytes] : first) {
    EXPECT_EQ(Text(file), bytes) << file;
  }
}

TEST_F(ReportFilesTest, ExpectationsAreAtTheEndOfAllThreeReports) {
  LogBoth();
  LogState(State(1, {Map(1), Map(2)}, 20));
  input_.expect = {{"groups", 1}, {"maps", 0}};
  const json checked = Report()["expectations"];
  ASSERT_EQ(checked.size(), 2U);
  EXPECT_EQ(checked[0]["met"], true);
  EXPECT_EQ(checked[1]["met"], false);
  EXPECT_THAT(markdown_, HasSubstr("\n## Expectations\n\n"));
  EXPECT_EQ(Text("report.md"), markdown_);
  EXPECT_THAT(Text("report.html"), HasSubstr("id=\"expectations\""));
}

TEST_F(ReportFilesTest, WithoutGroundTruthTheErrorsAreNullAndTheFilesStillCome) {
  for (const int32_t agent : {1, 2}) {
    fs::remove_all(Recording(agent) + "/mav0/state_groundtruth_estimate0");
  }
  LogBoth();
  LogState(State(1, {Map(1)}, 10));
  const json report = Report();
  EXPECT_FALSE(report.contains("expectations"));
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

TEST_F(ReportFilesTest, TheLogAloneIsEnough) {
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

TEST_F(ReportFilesTest, BytesThatNobodyCountedAreTheUplinks) {
  LogBoth();
  input_.agents[0].bytes_up = input_.agents[0].bytes_down = std::nullopt;
  const json report = Report();
  EXPECT_EQ(report["agents"][0]["bytes_up"], 250'000);
  EXPECT_EQ(report["agents"][0]["bytes_down"], 900);
  EXPECT_EQ(report["agents"][1]["bytes_up"], 600'000);
}

TEST_F(ReportFilesTest, GroundTruthWithTooFewPosesIsSaid) {
  LogBoth();
  const std::string csv = Recording(1) + "/mav0/state_groundtruth_estimate0/data.csv";
  std::ifstream rows(csv);
  std::string row, two_a_second;
  for (int i = 0; std::getline(rows, row); ++i) {
    two_a_second += i % 50 == 3 ? row + "\n" : "";
  }
  std::ofstream(csv) << two_a_second;
  const json report = Report();
  EXPECT_TRUE(report["agents"][0]["ate_vio_m"].is_null());
  EXPECT_THAT(report["notes"], Contains(testing::AllOf(
                                   HasSubstr("agent 1: 0 of its "),
                                   HasSubstr("more than 0.1 s apart ground truth is not used"))));
}

TEST_F(ReportFilesTest, ASecondMapOfAnAgentHasFilesOfItsOwn) {
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

TEST_F(ReportFilesTest, BytesOfAnUplinkThatWasStartedAgainAreAddedUp) {
  LogBoth();
  input_.agents[0].bus_log = folder_ + "/restarted.lcm";
  {
    LogWriter log(input_.agents[0].bus_log);
    for (const int64_t bytes : {100'000, 400'000, 20'000, 50'000}) {
      status_t status{};
      status.process = "uplink_1";
      status.counters = {{"bytes_up", bytes}, {"bytes_down", bytes / 1000}};
      status.num_counters = 2;
      log.Write(channels::Status(status.process), status);
    }
  }
  input_.agents[0].bytes_up = 50'000;  // of the last start
  input_.agents[0].bytes_down = 50;
  const json agent = Report()["agents"][0];
  EXPECT_EQ(agent["bytes_up"], 450'000);
  EXPECT_EQ(agent["bytes_down"], 450);
}

TEST_F(ReportFilesTest, RubbishInTheLogIsCountedAndNamed) {
  LogBoth();
  const std::vector<uint8_t> rubbish{1, 2, 3};
  log_->WriteBytes("KEYFRAME_1", rubbish);
  log_->WriteBytes("KEYFRAME_xyz", rubbish);
  const json report = Report();
  EXPECT_EQ(report["agents"].size(), 2U);
  EXPECT_THAT(markdown_,
              HasSubstr("1 messages on KEYFRAME_1 are refused and ignored; the first: "));
}

TEST_F(ReportFilesTest, ProcessesAndRestartsAreReported) {
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
  EXPECT_THAT(report["notes"], Contains("posegraph died and was restarted"));
  EXPECT_THAT(markdown_, HasSubstr("Realtime: seconds of session per second of the process' CPU"));
  EXPECT_THAT(Text("report.html"), HasSubstr("median, p99: handling time of the newest 1000"));
}

TEST_F(ReportFilesTest, ThePointCloudIsColouredByAgentAndHasEachLandmarkOnce) {
  LogBoth();
  LogState(State(1, {Map(1), Map(2)}, NumKeyframes()));
  Report();
  const std::string ply = Text("map.ply");
  // For each agent: one common landmark, and one per keyframe; uncertain ones are left out.
  EXPECT_THAT(ply, HasSubstr(fmt::format("element vertex {}\n", 2 * (1 + NumKeyframes()))));
  // The common landmark is most certain from keyframe 0: 2 m ahead of it.
  const Eigen::Vector3d p = OdomFromTruth(1) * Truth(1, Seconds(0)) * Eigen::Vector3d(0, 0, 2);
  EXPECT_THAT(ply, HasSubstr(fmt::format("{:.4f} {:.4f} {:.4f} 0 114 178\n", p.x(), p.y(), p.z())));
  EXPECT_THAT(ply, HasSubstr(" 213 94 0\n"));
}

TEST_F(ReportFilesTest, AnEarlierReportLeavesNoFilesAndAPersonsFilesStay) {
  LogBoth();
  Report();  // two groups of one map
  const std::string others = "." + Underscored(Map(2));
  for (const std::string& file : {"map" + others + ".ply", std::string("agent_2.tum")}) {
    EXPECT_TRUE(Exists(file)) << file;
  }
  for (const std::string file : {"agent_3.tum", "notes.md", "map.mine.ply"}) {
    std::ofstream(folder_ + "/out/" + file) << "mine";
  }
  input_.server_log = folder_ + "/second.lcm";
  log_ = std::make_unique<LogWriter>(input_.server_log);
  LogKeyframes(Map(1), 0, NumKeyframes());
  input_.agents.resize(1);
  Report();
  for (const std::string& file : {"map" + others + ".ply", "trajectory" + others + ".png",
                                  std::string("agent_2.tum"), std::string("agent_2.vio.tum")}) {
    EXPECT_FALSE(Exists(file)) << file;
  }
  for (const std::string file : {"agent_3.tum", "notes.md", "map.mine.ply"}) {
    EXPECT_EQ(Text(file), "mine");
  }
}

TEST_F(ReportFilesTest, AForeignReportJsonRemovesNothing) {
  std::ofstream(folder_ + "/precious.ply") << "mine";
  std::ofstream(folder_ + "/out/map.1_x.ply") << "mine";
  std::ofstream(folder_ + "/out/report.json")
      << R"({"agents": [{"id": 1, "map_ids": ["1/x", "1/../../precious"]}]})";
  LogBoth();
  Report();
  EXPECT_EQ(Text("map.1_x.ply"), "mine");
  EXPECT_EQ(Text("../precious.ply"), "mine");
}

TEST_F(ReportFilesTest, AnEmptyLogStillGivesAReport) {
  const json report = Report();
  EXPECT_EQ(report["groups"], json::array());
  EXPECT_EQ(report["agents"][0]["keyframes"], 0);
  EXPECT_TRUE(Exists("trajectory.png"));
  EXPECT_TRUE(Exists("agent_1.tum"));
}

TEST_F(ReportFilesTest, WhatCannotBeDoneIsSaid) {
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
}  // namespace pangea
