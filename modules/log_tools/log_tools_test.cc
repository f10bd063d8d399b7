// Tests pangea-log's parts on the captured sample session.

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "files/testing/full_disk.h"
#include "log_file/log_reader.h"
#include "log_file/log_writer.h"
#include "log_tools/explain.h"
#include "log_tools/log_edit.h"
#include "log_tools/log_export.h"
#include "log_tools/log_info.h"
#include "log_tools/log_tools_test_world.h"
#include "log_tools/recording_arguments.h"

namespace pangea {
namespace {

namespace fs = std::filesystem;

std::vector<std::string> Events(const std::string& log) {
  std::vector<std::string> events;
  ReadLog(log, [&events](const LogEvent& event) {
    events.push_back(std::to_string(event.utime) + event.channel +
                     std::string(event.data.begin(), event.data.end()));
  });
  return events;
}

TEST_F(LogToolsTest, InfoNamesChannelsMapsAndResults) {
  const LogSummary summary = Summarise(kSample);
  EXPECT_TRUE(summary.reading.whole());
  ASSERT_EQ(summary.keyframes.size(), 2U);
  size_t keyframes = 0;
  for (const auto& [map, seqs] : summary.keyframes) {
    keyframes += seqs.size();
  }
  EXPECT_EQ(keyframes, 63U);
  EXPECT_GT(summary.results.at("accepted"), 0);
  const std::string text = ToText(summary, "sample");
  EXPECT_NE(text.find("KEYFRAME_1"), std::string::npos);
  EXPECT_NE(text.find("0-"), std::string::npos);
}

TEST_F(LogToolsTest, ATornTailIsNamed) {
  fs::copy_file(kSample, Path("torn.lcm"));
  fs::resize_file(Path("torn.lcm"), fs::file_size(kSample) - 100);
  const LogSummary whole = Summarise(kSample), torn = Summarise(Path("torn.lcm"));
  EXPECT_EQ(torn.events, whole.events - 1);
  EXPECT_GT(torn.reading.torn_bytes, 0);
  EXPECT_NE(ToText(torn, "torn").find("ends in the middle of an event"), std::string::npos);
}

TEST_F(LogToolsTest, CutsAddUpToTheWhole) {
  const double middle = 10;
  CutLog(kSample, {.to_s = middle}, Path("a.lcm"));
  CutLog(kSample, {.from_s = middle}, Path("b.lcm"));
  const auto a = Events(Path("a.lcm")), b = Events(Path("b.lcm"));
  EXPECT_GT(a.size(), 10U);
  EXPECT_GT(b.size(), 10U);
  EXPECT_EQ(MergeLogs({Path("b.lcm"), Path("a.lcm")}, Path("ab.lcm")),
            static_cast<int64_t>(a.size() + b.size()));
  auto all = Events(kSample), merged = Events(Path("ab.lcm"));
  std::ranges::sort(all);
  std::ranges::sort(merged);
  EXPECT_TRUE(merged == all);  // too long to print the difference
}

// By capture time, but each log keeps its own order: its stamps may decrease.
TEST_F(LogToolsTest, MergesByTimeAndKeepsEachLogsOrder) {
  const auto write = [this](const std::string& name, const std::vector<int64_t>& utimes) {
    LogFileWriter log(Path(name));
    for (const int64_t utime : utimes) {
      log.Write(utime, name, {});
    }
    return Path(name);
  };
  MergeLogs({write("a", {10, 20, 15}), write("b", {12, 18, 20})}, Path("ab.lcm"));
  EXPECT_THAT(Events(Path("ab.lcm")),
              testing::ElementsAre("10a", "12b", "18b", "20a", "15a", "20b"));
}

TEST_F(LogToolsTest, TrajectoriesOfALogWithoutKeyframesAreRefused) {
  CutLog(kSample, {.channels = "CONSTRAINT"}, Path("constraints.lcm"));
  EXPECT_THAT([this] { ExportTum(Path("constraints.lcm"), Path("tum")); },
              testing::ThrowsMessage<std::runtime_error>(testing::HasSubstr("no KEYFRAME_*")));
  EXPECT_FALSE(fs::exists(Path("tum")));
}

TEST_F(LogToolsTest, AMergeWithWhatIsNoLogLeavesNoFile) {
  std::ofstream(Path("text")) << std::string(1000, 'x');
  EXPECT_THROW(MergeLogs({kSample, Path("text")}, Path("both.lcm")), std::runtime_error);
  EXPECT_FALSE(fs::exists(Path("both.lcm")));
}

TEST_F(LogToolsTest, CutsChannelsAndOverwritesNothing) {
  const int64_t events = CutLog(kSample, {.channels = "KEYFRAME_1"}, Path("one.lcm"));
  const LogSummary summary = Summarise(Path("one.lcm"));
  EXPECT_EQ(summary.events, events);
  EXPECT_EQ(summary.channels.size(), 1U);
  EXPECT_THROW(CutLog(kSample, {}, Path("one.lcm")), std::runtime_error);
  EXPECT_EQ(Summarise(Path("one.lcm")).events, events);
  EXPECT_THROW(CutLog(kSample, {.channels = "("}, Path("other.lcm")), std::runtime_error);
  EXPECT_THROW(CutLog(kSample, {.from_s = 6, .to_s = 2}, Path("other.lcm")), std::runtime_error);
  EXPECT_FALSE(fs::exists(Path("other.lcm")));
}

// Also if the program is killed, a part of a log does not pass for the whole.
TEST_F(LogToolsTest, ANewLogGetsItsNameWhenItIsComplete) {
  const std::string path = Path("new.lcm");
  NewLog log(path);
  log.Write(1, "A", std::vector<uint8_t>{1});
  EXPECT_FALSE(fs::exists(path));
  log.Keep();
  EXPECT_EQ(log.count(), 1);
  EXPECT_EQ(Events(path).size(), 1u);
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_), fs::directory_iterator()), 1);
}

TEST_F(LogToolsTest, AListWithoutAnEventIsRefusedAsACutIs) {
  std::ostringstream out;
  EXPECT_THAT([&] { ListEvents(kSample, {.channels = "NOPE"}, ListAs::kLines, out); },
              testing::ThrowsMessage<std::runtime_error>(testing::HasSubstr(
                  "session.lcm: no event of NOPE from 0 s to the end; pangea-log")));
  EXPECT_EQ(out.str(), "");
  ListEvents(kSample, {.to_s = 1}, ListAs::kLines, out);
  EXPECT_NE(out.str(), "");
}

// The clock was set back, as at the start of a phone: later events keep the latest time.
TEST_F(LogToolsTest, TimesOfAListDoNotGoBack) {
  NewLog log(Path("back.lcm"));
  for (const int64_t utime : {1'000'000, 4'000'000, 2'000'000, 5'000'000}) {
    log.Write(utime, fmt::format("AT_{}", utime), std::vector<uint8_t>{1});
  }
  log.Keep();
  std::ostringstream out;
  ListEvents(Path("back.lcm"), {.from_s = 3}, ListAs::kLines, out);
  EXPECT_THAT(out.str(), testing::AllOf(testing::HasSubstr("  3.000000  AT_4000000"),
                                        testing::HasSubstr("  3.000000  AT_2000000"),
                                        testing::HasSubstr("  4.000000  AT_5000000")));
}

TEST_F(LogToolsTest, ARecordingIsOfAnAgentOfTheLog) {
  const std::string folder = testing::TempDir();
  EXPECT_EQ(AgentsIn({kSample}), (std::set<int32_t>{1, 2}));
  EXPECT_EQ(RecordingsOf({"2=" + folder}, {kSample}).at(2), folder);
  EXPECT_THAT([&] { RecordingsOf({"9=" + folder}, {kSample}); },
              testing::ThrowsMessage<std::runtime_error>(
                  testing::AllOf(testing::HasSubstr("nothing of agent 9 in"),
                                 testing::HasSubstr("there are agents 1, 2"))));
}

// A journal has the constraints, but not the fusions that they led to.
TEST_F(LogToolsTest, AnExportWithoutStatesIsRemarkedOn) {
  EXPECT_EQ(RemarkOnExport(kSample), "");
  CutLog(kSample, {.channels = "KEYFRAME_.*|CONSTRAINT"}, Path("journal.lcm"));
  EXPECT_THAT(RemarkOnExport(Path("journal.lcm")), testing::HasSubstr("no MAP_STATE"));
  CutLog(kSample, {.channels = "KEYFRAME_.*"}, Path("keyframes.lcm"));
  EXPECT_EQ(RemarkOnExport(Path("keyframes.lcm")), "");
}

// An independent parser of the file gives the same cost as our own convention.
TEST_F(LogToolsTest, TrajectoriesAndPoints) {
  EXPECT_EQ(ExportTum(kSample, Path("tum")).size(), 2U);
  EXPECT_GT(fs::file_size(Path("tum/agent_1.tum")), 1000U);
  ExportPly(kSample, Path("map.ply"));
  EXPECT_GT(fs::file_size(Path("map.ply")), 10000U);
}

// Verification results computed again from the log mostly equal those in the log: acceptance was
// less strict when the sample was captured, and windows had only tracked landmarks.
TEST_F(LogToolsTest, ExplainsAcceptedAndRefusedResults) {
  std::istringstream results(ListResults(kSample));
  std::map<std::string, Explanation> same;  // by reason
  int num_results = 0, num_same = 0;
  for (std::string line; std::getline(results, line); ++num_results) {
    const Explanation explanation = Explain(kSample, std::stoll(line));
    if (explanation.again.reason == explanation.said.reason) {
      ++num_same;
      same.emplace(explanation.said.reason, explanation);
    }
  }
  EXPECT_GT(num_same, 0.8 * num_results);
  EXPECT_GE(same.size(), 3U);
  for (const auto& [reason, explanation] : same) {
    EXPECT_NE(ToText(explanation).find(reason), std::string::npos);
  }
  const Explanation& accepted = same.at("");
  EXPECT_LT(accepted.again.T_from_to.Minus(accepted.said.T_from_to).norm(), 0.01);
  EXPECT_GT(accepted.report.found.size(), 10U);
  EXPECT_THAT(
      ToText(accepted),
      testing::ContainsRegex("halves of the view +max_halves_chi2 +[0-9.e-]+ +at most +22.5\n"));
  WriteExplanationPng(accepted, {}, Path("picture.png"));
  EXPECT_GT(fs::file_size(Path("picture.png")), 10000U);
  EXPECT_THROW(Explain(kSample, 42), std::runtime_error);
}

// The window BA may drop every match that is in the two keyframes themselves.
TEST(Explanation, IsToldWithoutAnInlier) {
  Explanation explanation;
  explanation.again.reason = "too few inliers";
  explanation.report.found.resize(2);
  const std::string text = ToText(explanation);
  EXPECT_NE(text.find("0 of 2 inliers in the two keyframes"), std::string::npos) << text;
  EXPECT_NE(text.find("inliers miss by - px"), std::string::npos) << text;
}

// A part of a log must not pass for the whole.
TEST_F(LogToolsTest, AFullDiskLeavesNoPartOfALog) {
  const FullDisk full(300'000);
  EXPECT_THROW(CutLog(kSample, {}, Path("cut.lcm")), std::runtime_error);
  EXPECT_THROW(MergeLogs({kSample, kSample}, Path("merged.lcm")), std::runtime_error);
  EXPECT_TRUE(fs::is_empty(folder_));
}

}  // namespace
}  // namespace pangea
