#include "session/session_file/session_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

namespace pangea::session {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

class SessionFileTest : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::path(testing::TempDir()) /
              ("session_file_" +
               std::string(testing::UnitTest::GetInstance()->current_test_info()->name()));
    fs::remove_all(folder_);
    fs::create_directories(folder_ / "recordings" / "MH_01_easy" / "mav0");
    fs::create_directories(folder_ / "recordings" / "MH_02" / "mav0");
    fs::create_directories(folder_ / "sessions");
  }
  fs::path Write(const std::string& text) {
    fs::path file = folder_ / "sessions" / "two.yaml";
    std::ofstream(file) << text;
    return file;
  }
  std::string ErrorOf(const std::string& text) {
    try {
      ReadSessionFile(Write(text), std::nullopt);
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return "no error";
  }
  fs::path folder_;
};

TEST_F(SessionFileTest, ReadsAgentsAndFindsRecordings) {
  const SessionScript script = ReadSessionFile(
      Write("agents:\n"
            "  - {id: 1, recording: ../recordings/MH_01}\n"
            "  - {id: 2, recording: ../recordings/MH_02, delay: 5, start: 10, duration: 60}\n"),
      std::nullopt);
  ASSERT_EQ(script.agents.size(), 2u);
  EXPECT_EQ(script.agents[0].resolved, folder_ / "recordings" / "MH_01_easy");
  EXPECT_EQ(script.agents[1].resolved, folder_ / "recordings" / "MH_02");
  EXPECT_EQ(script.agents[1].delay_s, 5);
  EXPECT_EQ(script.agents[1].start_s, 10);
  EXPECT_EQ(script.agents[1].duration_s, 60);
}

TEST_F(SessionFileTest, ReadsTheOptionsOfEveryProcess) {
  const std::string agents = "agents:\n  - {id: 1, recording: ../recordings/MH_01";
  const SessionScript script = ReadSessionFile(
      Write(agents + ", vio: {estimator: {window: 9}}}\n"
                     "options: {fusion: {alignment: {min_inliers: 20}}, place_recognition: "
                     "{max_keyframes: 7}}\n"),
      std::nullopt);
  ASSERT_TRUE(script.agents[0].vio_options);
  EXPECT_EQ(script.agents[0].vio_options->vio.estimator.window, 9);
  EXPECT_EQ(script.options.fusion.alignment.min_inliers, 20);
  EXPECT_EQ(script.options.place_recognition.max_keyframes, 7);
  EXPECT_FALSE(ReadSessionFile(Write(agents + "}\n"), std::nullopt).agents[0].vio_options);
  EXPECT_THAT(ErrorOf(agents + "}\noptions: {fusion: {alignment: {min_inliers: 0}}}\n"),
              HasSubstr("two.yaml:3: key 'options.fusion.alignment.min_inliers' must be a "
                        "whole number from 4 to 100000, not '0'"));
  EXPECT_THAT(ErrorOf(agents + "}\noptions: {fuson: {}}\n"),
              HasSubstr("did you mean 'options.fusion'?"));
  EXPECT_THAT(ErrorOf(agents + ", keyframes: one.lcm, vio: {estimator: {window: 9}}}\n"),
              HasSubstr("leave out 'vio'"));
}

TEST_F(SessionFileTest, ReadsOptionsOfTheLink) {
  const std::string agent =
      "agents:\n  - {id: 1, recording: ../recordings/MH_01, uplink: {budget_kb_per_s: ";
  const SessionScript script =
      ReadSessionFile(Write(agent + "20, packet_bytes: 4096}}\n"
                                    "options: {agent_handler: {cache_bytes: 500000}}\n"),
                      std::nullopt);
  EXPECT_EQ(script.agents[0].uplink.budget_kb_per_s, 20);
  EXPECT_EQ(script.agents[0].uplink.sender.payload_bytes, 4096);
  EXPECT_EQ(script.options.agent_handler.receiver.cache_bytes, 500'000);
  for (const char* bad : {"-20", ".nan", ".inf", "1e300"}) {
    EXPECT_THAT(
        ErrorOf(agent + bad + "}}\n"),
        testing::AllOf(HasSubstr("two.yaml:2: key 'agents[0].uplink.budget_kb_per_s' must be a "
                                 "number from 0 to 1000000"),
                       HasSubstr(bad)));
  }
  EXPECT_THAT(ErrorOf(agent + "1}}\n"),
              HasSubstr("agent 1: uplink: the budget must be at least 5 kB/s"));
}

TEST_F(SessionFileTest, ReadsLiveAgents) {
  const SessionScript script = ReadSessionFile(
      Write("agents:\n"
            "  - {id: 1, live: true}\n"
            "  - {id: 2, live: true, duration: 60, recording: ../recordings/MH_02}\n"),
      std::nullopt);
  EXPECT_TRUE(script.agents[0].live);
  EXPECT_EQ(script.agents[1].duration_s, 60);
  EXPECT_EQ(script.agents[1].resolved, folder_ / "recordings" / "MH_02");
  EXPECT_THAT(ErrorOf("agents: [{id: 1}]\n"),
              HasSubstr("'recording', 'keyframes', or 'live: true'"));
  EXPECT_THAT(ErrorOf("agents: [{id: 1, live: true, keyframes: one.lcm}]\n"),
              HasSubstr("leave out 'keyframes'"));
  EXPECT_THAT(ErrorOf("agents: [{id: 1, live: true, start: 3}]\n"), HasSubstr("leave out 'start'"));
  CheckRate("1", script);
  for (const char* rate : {"2", "max"}) {
    EXPECT_THROW(CheckRate(rate, script), std::runtime_error) << rate;
  }
}

TEST_F(SessionFileTest, ReadsLinkAndKeyframes) {
  std::ofstream(folder_ / "sessions" / "one.lcm") << "log";
  const SessionScript script =
      ReadSessionFile(Write("agents:\n"
                            "  - {id: 1, recording: ../recordings/MH_01, keyframes: one.lcm,\n"
                            "     link: {loss: 0.1, partitions: [{at: 30, seconds: 60}]}}\n"
                            "  - {id: 2, recording: ../recordings/MH_02}\n"
                            "  - {id: 3, keyframes: one.lcm}\n"),
                      std::nullopt);
  EXPECT_TRUE(script.agents[2].resolved.empty());
  EXPECT_EQ(script.agents[0].resolved_keyframes, folder_ / "sessions" / "one.lcm");
  ASSERT_TRUE(script.agents[0].link);
  EXPECT_EQ(script.agents[0].link->loss, 0.1);
  EXPECT_EQ(script.agents[0].link->partitions.at(0).seconds, 60);
  EXPECT_FALSE(script.agents[1].link);
  EXPECT_TRUE(script.agents[1].resolved_keyframes.empty());
}

TEST_F(SessionFileTest, RecordingsFolderOnTheCommandLine) {
  const SessionScript script =
      ReadSessionFile(Write("agents: [{id: 7, recording: MH_02}]\n"), folder_ / "recordings");
  EXPECT_EQ(script.agents[0].resolved, folder_ / "recordings" / "MH_02");
}

TEST_F(SessionFileTest, ReadsExpectations) {
  const std::string agent = "agents: [{id: 1, recording: ../recordings/MH_02}]\n";
  EXPECT_TRUE(ReadSessionFile(Write(agent), std::nullopt).expect.empty());
  const SessionScript script =
      ReadSessionFile(Write(agent + "expect: {fused_by: 40, ate_joint_m: 0.1}\n"), std::nullopt);
  EXPECT_THAT(script.expect,
              testing::ElementsAre(std::pair("ate_joint_m", 0.1), std::pair("fused_by", 40)));
  EXPECT_THAT(ErrorOf(agent + "expect: {ate_joint: 0.1}\n"),
              testing::AllOf(HasSubstr("two.yaml:2"), HasSubstr("'expect.ate_joint'"),
                             HasSubstr("did you mean 'expect.ate_joint_m'?")));
  EXPECT_THAT(ErrorOf(agent + "expect: {coverage: -1}\n"), HasSubstr("coverage"));
}

TEST_F(SessionFileTest, ADisconnectIsAPartitionOfTheLink) {
  SessionScript script = ReadSessionFile(
      Write("agents:\n"
            "  - {id: 1, recording: ../recordings/MH_01}\n"
            "  - {id: 2, recording: ../recordings/MH_02,\n"
            "     link: {loss: 0.1, partitions: [{at: 1, seconds: 2}]}}\n"
            "  - {id: 3, recording: ../recordings/MH_02}\n"
            "faults: [{at: 12, disconnect: 1, seconds: 6}, {at: 20, disconnect: 2}]\n"),
      std::nullopt);
  EXPECT_THROW(PlaceDisconnects("max", &script), std::runtime_error);
  PlaceDisconnects("2", &script);
  ASSERT_TRUE(script.agents[0].link && script.agents[1].link);
  EXPECT_FALSE(script.agents[2].link);
  ASSERT_EQ(script.agents[0].link->partitions.size(), 1u);
  EXPECT_EQ(script.agents[0].link->partitions[0].at_s, 6);
  EXPECT_EQ(script.agents[0].link->partitions[0].seconds, 3);
  EXPECT_EQ(script.agents[0].link->loss, 0);
  ASSERT_EQ(script.agents[1].link->partitions.size(), 2u);
  EXPECT_EQ(script.agents[1].link->partitions[1].at_s, 10);
  EXPECT_EQ(script.agents[1].link->loss, 0.1);
}

TEST_F(SessionFileTest, ReadsAnchors) {
  const std::string agents =
      "agents: [{id: 1, recording: ../recordings/MH_01}, {id: 2, live: true}]\n";
  const std::string kettle = "{agent: 1, at: 12, name: kettle, pixel: [376, 240.5]}";
  const SessionScript script = ReadSessionFile(
      Write(agents + "anchors:\n  - " + kettle +
            "\n  - {agent: 1, at: 0, name: pot, pixel: [0, 20000], payload: '{\"a\": 1}'}\n"),
      std::nullopt);
  ASSERT_EQ(script.anchors.size(), 2u);
  EXPECT_EQ(script.anchors[0].agent, 1);
  EXPECT_EQ(script.anchors[0].at_s, 12);
  EXPECT_EQ(script.anchors[0].name, "kettle");
  EXPECT_EQ(script.anchors[0].pixel, Eigen::Vector2d(376, 240.5));
  EXPECT_EQ(script.anchors[0].payload, "");
  EXPECT_EQ(script.anchors[1].payload, R"({"a": 1})");
  const auto refuses = [&](const std::string& anchor, const std::string& why) {
    EXPECT_THAT(ErrorOf(agents + "anchors:\n  - " + anchor + "\n"),
                testing::AllOf(HasSubstr("two.yaml:"), HasSubstr(why)));
  };
  refuses("{agent: 3, at: 1, name: a, pixel: [1, 1]}", "anchors: a: there is no agent 3");
  refuses("{agent: 2, at: 1, name: a, pixel: [1, 1]}", "anchors: a: agent 2 has no 'recording'");
  refuses(kettle + "\n  - " + kettle, "the name 'kettle' is given twice");
  refuses("{agent: 1, at: 1, name: '', pixel: [1, 1]}", "'name' must be a text");
  refuses("{agent: 1, at: 1, name: \"a\\nb\", pixel: [1, 1]}", "printable");
  refuses("{agent: 1, at: 1, name: \"a\\x9bb\", pixel: [1, 1]}", "printable");
  refuses("{agent: 1, at: 1, name: " + std::string(51, 'a') + ", pixel: [1, 1]}",
          ":3: key 'anchors[0].name' must be a text of at most 50 bytes, not 51");
  refuses("{agent: 1, at: 1, name: a, pixel: [1, 1], payload: " + std::string(1001, 'a') + "}",
          ":3: key 'anchors[0].payload' must be a text of at most 1000 bytes, not 1001");
  refuses("{agent: 1, at: 1, name: a, pixel: [1, 20001]}",
          ":3: key 'anchors[0].pixel[1]' must be a number from 0 to 20000, not '20001'");
  refuses("{agent: 1, at: 1, name: a, pixel: [-1, 1]}", "key 'anchors[0].pixel[0]'");
  for (const char* bad : {"7", "[7]", "[7, 7, 7]"}) {
    refuses("{agent: 1, at: 1, name: a, pixel: " + std::string(bad) + "}",
            ":3: key 'anchors[0].pixel' must be a list of two numbers, each from 0 to 20000");
  }
  refuses("{agent: 1, at: 1, name: a, pixl: [1, 1]}", "did you mean 'anchors[0].pixel'?");
  refuses("{agent: 1, at: 1, pixel: [1, 1]}", "name");
}

TEST_F(SessionFileTest, MoreAnchorsThanASessionTakesAreRefused) {
  std::string text = "agents: [{id: 1, recording: ../recordings/MH_01}]\nanchors:\n";
  const auto add = [&text](size_t i) {
    text += "  - {agent: 1, at: 1, name: a" + std::to_string(i) + ", pixel: [1, 1]}\n";
  };
  for (size_t i = 0; i < kMaxScriptedAnchors; ++i) {
    add(i);
  }
  EXPECT_EQ(ReadSessionFile(Write(text), std::nullopt).anchors.size(), kMaxScriptedAnchors);
  add(kMaxScriptedAnchors);
  EXPECT_THAT(ErrorOf(text), HasSubstr("'anchors' lists 1001: a session takes 1000 at most"));
}

TEST_F(SessionFileTest, UnknownKeysNameTheirLineAndTheNearest) {
  const std::string agent = "# a comment\nagents:\n  - {id: 1, recording: ../recordings/MH_02}\n";
  EXPECT_THAT(ErrorOf(agent + "fualts: []\n"),
              testing::AllOf(HasSubstr("two.yaml:4: unknown key 'fualts'"),
                             HasSubstr("did you mean 'faults'?")));
  EXPECT_THAT(ErrorOf(agent + "faults:\n  - {at: 1, disconect: 1}\n"),
              testing::AllOf(HasSubstr("two.yaml:5: unknown key 'faults[0].disconect'"),
                             HasSubstr("did you mean 'faults[0].disconnect'?")));
  EXPECT_THAT(ErrorOf(agent + "  - {id: 2, delya: 3, recording: x}\n"),
              testing::AllOf(HasSubstr("two.yaml:4"), HasSubstr("'agents[1].delay'")));
}

TEST_F(SessionFileTest, WhatIsMissingIsNamedAllAtOnce) {
  EXPECT_THAT(ErrorOf("agents:\n  - {id: 1, recording: ../recordings/MH_08}\n"
                      "  - {id: 2, recording: ../recordings/MH_09, keyframes: no.lcm}\n"),
              testing::AllOf(HasSubstr("agent 1: recording"), HasSubstr("MH_08"),
                             HasSubstr("agent 2: recording"), HasSubstr("agent 2: keyframes"),
                             HasSubstr("--recordings")));
}

TEST_F(SessionFileTest, ErrorsNameTheMend) {
  EXPECT_THAT(ErrorOf("agents: [{id: 1, recording: ../recordings/MH_09}]\n"),
              testing::AllOf(HasSubstr("MH_09"), HasSubstr("--recordings")));
  EXPECT_THAT(ErrorOf("agents: [{id: 1, recordin: ../recordings/MH_02}]\n"),
              testing::AllOf(HasSubstr("recordin"), HasSubstr("recording")));
  EXPECT_THAT(ErrorOf("agents:\n  - {id: 1, recording: ../recordings/MH_02}\n"
                      "  - {id: 1, recording: ../recordings/MH_02}\n"),
              HasSubstr("twice"));
  EXPECT_THAT(ErrorOf("agents: []\n"), HasSubstr("empty"));
  EXPECT_THAT(ErrorOf("agents: [{id: 6}]\n"),
              testing::AllOf(HasSubstr("agent 6"), HasSubstr("'recording'")));
  EXPECT_THAT(ErrorOf("agents: [{id: 1, recording: ../recordings/MH_02, link: {los: 0.1}}]\n"),
              HasSubstr("'agents[0].link.loss'"));
  EXPECT_THAT(ErrorOf("agents: [{id: 4, recording: ../recordings/MH_02, link: {loss: 5}}]\n"),
              HasSubstr("'agents[0].link.loss' must be a number from 0 to 1, not '5'"));
  const std::string agent = "agents: [{id: 1, recording: ../recordings/MH_02}]\n";
  EXPECT_THAT(ErrorOf(agent + "faults: [{at: 3, kill: fusoin}]\n"),
              testing::AllOf(HasSubstr("'fusoin'"), HasSubstr("did you mean 'fusion'?")));
  EXPECT_THAT(ErrorOf(agent + "faults: [{at: 3, kill: everything_there_is}]\n"),
              testing::AllOf(HasSubstr("fusion, global_ba"), HasSubstr("uplink_1")));
  EXPECT_THAT(ErrorOf(agent + "faults: [{at: 3}]\n"), HasSubstr("one of 'kill' or 'disk_full'"));
  EXPECT_THAT(ErrorOf(agent + "faults: [{at: 3, kill: vio_1, disconnect: 1}]\n"),
              HasSubstr("one of 'kill' or 'disk_full'"));
  EXPECT_THAT(ErrorOf(agent + "faults: [{at: 3, disconnect: 2}]\n"),
              HasSubstr("there is no agent 2"));
  EXPECT_THAT(ErrorOf("agents: [{id: 1, recording: ../recordings/MH_02, keyframes: no.lcm}]\n"),
              testing::AllOf(HasSubstr("no.lcm"), HasSubstr("--out-keyframes")));
}

// Otherwise, for instance, an agent would never start or a session would never end.
TEST_F(SessionFileTest, EveryNumberHasItsRange) {
  const std::string agent = "agents:\n  - {id: 1, recording: ../recordings/MH_02}\n";
  const auto refuses = [&](const std::string& text, const std::string& key,
                           const std::string& range) {
    EXPECT_THAT(ErrorOf(text),
                testing::MatchesRegex(".*two.yaml:[0-9]+: key '" + key +
                                      "' must be a (whole )?number from " + range + ", not '.*"))
        << text;
  };
  for (const std::string bad : {"-3", ".nan", ".inf", "1e300"}) {
    for (const std::string key : {"delay", "start", "duration"}) {
      refuses("agents: [{id: 1, recording: ../recordings/MH_02, " + key + ": " + bad + "}]\n",
              "agents.0.\\." + key, "0 to 1000000");
    }
    for (const std::string key : {"at", "seconds"}) {
      refuses(agent + "faults: [{kill: vio_1, " + key + ": " + bad + "}]\n", "faults.0.\\." + key,
              "0 to 1000000");
    }
    refuses(agent + "expect: {coverage: " + bad + "}\n", "expect.coverage", "0 to 1");
    refuses(agent + "anchors: [{agent: 1, name: a, pixel: [1, 1], at: " + bad + "}]\n",
            "anchors.0.\\.at", "0 to 1000000");
    refuses(agent + "expect: {groups: " + bad + "}\n", "expect.groups", "0 to 1000000");
  }
  for (const std::string id : {"0", "-1", "65536"}) {
    refuses("agents: [{id: " + id + ", recording: ../recordings/MH_02}]\n", "agents.0..id",
            "1 to 65535");
    refuses(agent + "faults: [{at: 3, disconnect: " + id + "}]\n", "faults.0..disconnect",
            "1 to 65535");
  }
}

TEST_F(SessionFileTest, MoreAgentsThanASessionTakesAreRefused) {
  const auto agents = [](size_t count) {
    std::string text = "agents:\n";
    for (size_t id = 1; id <= count; ++id) {
      text += "  - {id: " + std::to_string(id) + ", recording: ../recordings/MH_02}\n";
    }
    return text;
  };
  EXPECT_EQ(ReadSessionFile(Write(agents(kMaxSessionAgents)), std::nullopt).agents.size(),
            kMaxSessionAgents);
  EXPECT_THAT(ErrorOf(agents(kMaxSessionAgents + 1)),
              testing::AllOf(HasSubstr("two.yaml: 'agents' lists 201"),
                             HasSubstr("a session takes 200 at most")));
}

}  // namespace
}  // namespace pangea::session
