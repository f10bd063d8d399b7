#include "session/session_file.h"

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

TEST_F(SessionFileTest, ReadsABudget) {
  const std::string agent =
      "agents:\n  - {id: 1, recording: ../recordings/MH_01, budget_kb_per_s: ";
  EXPECT_EQ(ReadSessionFile(Write(agent + "20}\n"), std::nullopt).agents[0].budget_kb_per_s, 20);
  for (const char* bad : {"1", "-20", ".nan", ".inf"}) {
    EXPECT_THAT(ErrorOf(agent + bad + "}\n"), HasSubstr("budget_kb_per_s must be at least 5"))
        << bad;
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
  EXPECT_THAT(ErrorOf("agents: [{id: 1, recording: ../recordings/MH_02, start: -3}]\n"),
              HasSubstr("negative"));
  EXPECT_THAT(ErrorOf("agents: [{id: 1, recording: ../recordings/MH_02, link: {los: 0.1}}]\n"),
              HasSubstr("'agents[0].link.loss'"));
  EXPECT_THAT(ErrorOf("agents: [{id: 4, recording: ../recordings/MH_02, link: {loss: 5}}]\n"),
              testing::AllOf(HasSubstr("agent 4: link: loss 5"), HasSubstr("0 to 1")));
  const std::string agent = "agents: [{id: 1, recording: ../recordings/MH_02}]\n";
  EXPECT_THAT(ErrorOf(agent + "faults: [{at: 3, kill: fusoin}]\n"),
              testing::AllOf(HasSubstr("'fusoin'"), HasSubstr("fusion"), HasSubstr("uplink_1")));
  EXPECT_THAT(ErrorOf(agent + "faults: [{at: 3}]\n"), HasSubstr("'kill' or 'disk_full'"));
  EXPECT_THAT(ErrorOf(agent + "faults: [{at: -3, kill: vio_1}]\n"), HasSubstr("negative"));
  EXPECT_THAT(ErrorOf("agents: [{id: 1, recording: ../recordings/MH_02, keyframes: no.lcm}]\n"),
              testing::AllOf(HasSubstr("no.lcm"), HasSubstr("--out-keyframes")));
}

}  // namespace
}  // namespace pangea::session
