// Tests that only maps made from an agent's recording are compared with its ground truth: a
// continued journal has maps of other recordings, with the same stamps.

#include "report/metrics/recording_maps.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "messages/channels.h"
#include "messages/messages.h"
#include "report/report_test_world.h"
#include "report/session_record.h"

namespace pangea {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr int32_t kOtherWalk = 3;  // the path of agent 1's earlier recording

// Agent 1's earlier map is fused with the maps of today.
class RecordingMapsTest : public ReportWorld {
 protected:
  static MapId Earlier() { return Map(1, -500); }

  void LogThree() {
    LogKeyframes(Earlier(), 0, NumKeyframes(), kOtherWalk);
    LogBoth();
    MapState state = State(1, {Map(1), Map(2)}, NumKeyframes());
    state.maps = {Earlier(), Map(1), Map(2)};
    for (int seq = 0; seq < NumKeyframes(); ++seq) {
      state.keyframes.push_back({{Earlier(), seq}, Utime(Seconds(seq)), EarlierPose(seq)});
    }
    LogState(state);
    Constraint constraint;
    constraint.from = {Earlier(), 4};
    constraint.to = {Map(2), 4};
    constraint.accepted = true;
    constraint.T_from_to = Truth(kOtherWalk, Seconds(4)).Inverse() * Truth(2, Seconds(4));
    log_->Write(std::string(channels::kConstraint), ToMessage(constraint));
  }

  static Rigid3 EarlierPose(int seq) { return OdomFromTruth(1) * Truth(kOtherWalk, Seconds(seq)); }

  static size_t NumPoses() { return static_cast<size_t>(NumKeyframes()); }

  void ExpectOnlyTodaysIsCompared(const json& report) const {
    const json& agent = report["agents"][0];
    EXPECT_LT(agent["ate_server_m"].get<double>(), 1e-5);
    EXPECT_LT(agent["ate_vio_m"].get<double>(), 0.08);
    EXPECT_EQ(agent["coverage"], 1.0);
    EXPECT_EQ(agent["map_ids"].size(), 2U);
    EXPECT_EQ(agent["map_ids_not_compared"], json::array({ToString(Earlier())}));
    EXPECT_LT(report["ate_joint_m"].get<double>(), 1e-5);
    EXPECT_EQ(report["constraints_truth"]["checked"], 0);
    EXPECT_THAT(report["notes"],
                Contains(HasSubstr("agent 1: 1 of its 2 maps, " + ToString(Earlier()) +
                                   ", are of other sessions")));
  }

  void ExpectATrajectoryForEachMap() const {
    const Trajectory today = Tum("agent_1.tum");
    const Trajectory earlier = Tum("agent_1." + Underscored(Earlier()) + ".tum");
    ASSERT_EQ(today.size(), NumPoses());
    ASSERT_EQ(earlier.size(), NumPoses());
    for (int seq = 0; seq < NumKeyframes(); ++seq) {
      const Rigid3 T = OdomFromTruth(1) * Truth(1, Seconds(seq));
      EXPECT_LT(today[static_cast<size_t>(seq)].T.Minus(T).norm(), 1e-6);
      EXPECT_LT(earlier[static_cast<size_t>(seq)].T.Minus(EarlierPose(seq)).norm(), 1e-6);
    }
    EXPECT_FALSE(Exists("agent_1." + Underscored(Map(1)) + ".tum")) << "it is agent_1.tum";
  }
};

TEST_F(RecordingMapsTest, TheMapsOnTheAgentsBusAreOfItsRecording) {
  LogThree();
  ExpectOnlyTodaysIsCompared(Report());
  ExpectATrajectoryForEachMap();
}

// Stored keyframes are played without poses between them.
TEST_F(RecordingMapsTest, KeyframesOnTheAgentsBusAreEnough) {
  LogThree();
  const std::string server_log = input_.server_log;
  log_ = std::make_unique<LogWriter>(folder_ + "/keyframes.lcm");
  LogKeyframes(Map(1), 0, NumKeyframes());
  input_.agents[0].bus_log = folder_ + "/keyframes.lcm";
  ExpectOnlyTodaysIsCompared(Report());
}

TEST_F(RecordingMapsTest, AReplayKnowsThemByTheSessionsRecord) {
  LogThree();
  input_.agents[0].maps = {Map(1)};
  SessionRecord record;
  record.agents = input_.agents;
  WriteSessionRecord(record, folder_);
  input_.agents = ReadSessionRecord({input_.server_log}).agents;
  ASSERT_TRUE(input_.agents[0].bus_log.empty());
  EXPECT_THAT(*input_.agents[0].maps, ElementsAre(Map(1)));
  EXPECT_FALSE(input_.agents[1].maps);
  const json report = Report();
  ExpectOnlyTodaysIsCompared(report);
  EXPECT_NEAR(report["agents"][0]["initialised_s"].get<double>(), kInit, 1e-6);
  ExpectATrajectoryForEachMap();
}

// Two days' logs together: each map is of its own day's recording.
TEST_F(RecordingMapsTest, ALogMadeOfTwoSessionsKeepsBothRecordings) {
  for (const char* day : {"first", "second"}) {
    fs::create_directories(folder_ + "/" + day);
    AgentRun run;
    run.id = 1;
    run.recording = Recording(std::string(day) == "first" ? 1 : 2);
    run.maps = {std::string(day) == "first" ? Earlier() : Map(1)};
    SessionRecord record;
    record.agents = {run};
    WriteSessionRecord(record, folder_ + "/" + day);
  }
  KeepRecordings({folder_ + "/first/session.lcm", folder_ + "/second/session.lcm"},
                 folder_ + "/both.lcm");
  const SessionRecord both = ReadSessionRecord({folder_ + "/both.lcm"});
  EXPECT_EQ(RecordingOf(Earlier(), both), Recording(1));
  EXPECT_EQ(RecordingOf(Map(1), both), Recording(2));
  EXPECT_EQ(RecordingOf(Map(1, 7), both), std::nullopt);
}

TEST_F(RecordingMapsTest, MapsThatOverlapAreNotOfOneRecording) {
  LogThree();
  input_.agents[0].bus_log.clear();
  const json report = Report();
  const json& agent = report["agents"][0];
  EXPECT_TRUE(agent["ate_server_m"].is_null());
  EXPECT_TRUE(agent["ate_vio_m"].is_null());
  EXPECT_EQ(agent["map_ids_not_compared"].size(), 2U);
  EXPECT_LT(report["ate_joint_m"].get<double>(), 1e-5) << "of agent 2 alone";
  EXPECT_THAT(report["notes"], Contains(HasSubstr("agent 1: 2 of its 2 maps, ")));
  EXPECT_EQ(Tum("agent_1.tum").size(), NumPoses());
  EXPECT_TRUE(Exists("agent_1." + Underscored(Map(1)) + ".tum") !=
              Exists("agent_1." + Underscored(Earlier()) + ".tum"));
}

// A recording that was lost on the way has two maps, one after the other.
TEST_F(RecordingMapsTest, SuccessiveMapsAreOfOneRecording) {
  LogKeyframes(Map(1), 0, 20);
  LogKeyframes(Map(1, 1), 20, NumKeyframes());
  MapState state = State(1, {Map(1)}, 20);
  state.maps = {Map(1), Map(1, 1)};
  for (int seq = 20; seq < NumKeyframes(); ++seq) {
    state.keyframes.push_back(
        {{Map(1, 1), seq - 20}, Utime(Seconds(seq)), OdomFromTruth(1) * Truth(1, Seconds(seq))});
  }
  LogState(state);
  input_.agents[0].bus_log.clear();
  const json report = Report();
  EXPECT_LT(report["agents"][0]["ate_server_m"].get<double>(), 1e-5);
  EXPECT_EQ(report["agents"][0]["coverage"], 1.0);
  EXPECT_EQ(report["agents"][0]["map_ids_not_compared"], json::array());
  EXPECT_EQ(Tum("agent_1.tum").size(), NumPoses());
  EXPECT_EQ(Tum("agent_1." + Underscored(Map(1)) + ".tum").size(), 20U);
  EXPECT_EQ(Tum("agent_1." + Underscored(Map(1, 1)) + ".tum").size(), NumPoses() - 20);
}

// Its map of today did not come about, so nothing is compared.
TEST_F(RecordingMapsTest, AnAgentThatMadeNoMapTodayHasNoError) {
  LogKeyframes(Earlier(), 0, NumKeyframes(), kOtherWalk);
  { const LogWriter nothing(folder_ + "/nothing.lcm"); }
  input_.agents[0].bus_log = folder_ + "/nothing.lcm";
  const json report = Report();
  EXPECT_TRUE(report["agents"][0]["ate_server_m"].is_null());
  EXPECT_TRUE(report["agents"][0]["ate_vio_m"].is_null());
  EXPECT_TRUE(report["ate_joint_m"].is_null());
  EXPECT_EQ(Tum("agent_1.tum").size(), NumPoses());
}

}  // namespace
}  // namespace pangea
