// Tests `replay --from-checkpoint`: until that time the log's matches and verification results are
// used, after it they are computed again.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <lcm/lcm-cpp.hpp>
#include <optional>
#include <set>

#include "log_file/log_reader.h"
#include "log_file/log_writer.h"
#include "messages/channels.h"
#include "messages/encoding.h"
#include "pangea/constraint_t.hpp"
#include "pangea/place_match_t.hpp"
#include "programs.h"

namespace pangea::tests {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;

constexpr double kCheckpoint_s = 6;
constexpr float kMark_px = 77;

// Marks every match and verification result of a log, without a change to anything else of the map.
void WriteMarked(const std::string& log, const std::string& marked) {
  LogFileWriter out(marked);
  ReadLog(log, [&out](const LogEvent& event) {
    place_match_t match{};
    constraint_t result{};
    if (event.channel == channels::kPlaceMatch && DecodeMessage(event.data, &match)) {
      match.rejected.emplace_back("marked");
      ++match.num_rejected;
      out.Write(event.utime, event.channel, EncodeMessage(match));
    } else if (event.channel == channels::kConstraint && DecodeMessage(event.data, &result)) {
      result.rms_px = kMark_px;
      out.Write(event.utime, event.channel, EncodeMessage(result));
    } else {
      out.Write(event.utime, event.channel, event.data);
    }
  });
}

struct Marks {
  int64_t marked = 0, others = 0;
  double last_marked_s = 0, first_other_s = 1e9;

  void Note(bool is_marked, double seconds) {
    ++(is_marked ? marked : others);
    (is_marked ? last_marked_s : first_other_s) =
        is_marked ? std::max(last_marked_s, seconds) : std::min(first_other_s, seconds);
  }
};

struct MarksOf {
  Marks matches, results;
  int64_t candidates = 0;            // in the matches
  std::set<int64_t> constraint_ids;  // of the verification results
};

MarksOf ReadMarks(const std::string& log) {
  MarksOf marks;
  std::optional<int64_t> begin;
  ReadLog(log, [&](const LogEvent& event) {
    begin = begin.value_or(event.utime);
    const double seconds = 1e-6 * static_cast<double>(event.utime - *begin);
    place_match_t match{};
    constraint_t result{};
    if (event.channel == channels::kPlaceMatch && DecodeMessage(event.data, &match)) {
      marks.candidates += match.num_candidates;
      marks.matches.Note(!match.rejected.empty() && match.rejected.back() == "marked", seconds);
    } else if (event.channel == channels::kConstraint && DecodeMessage(event.data, &result)) {
      marks.constraint_ids.insert(result.id);
      marks.results.Note(result.rms_px == kMark_px, seconds);
    }
  });
  return marks;
}

// The sample's replay, and that of its marked copy, made once for all tests of this file.
class ReplayCheckpoint : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new fs::path(FreshFolder("replay_checkpoint"));
    const Outcome whole = Replay(kSample, "whole");
    ASSERT_EQ(whole.exit_code, 0) << whole.output;
    WriteMarked(Log("whole"), Marked());
  }
  static void TearDownTestSuite() {
    fs::remove_all(*folder_);
    delete folder_;
  }
  static std::string Log(const std::string& name) {
    return (*folder_ / name / "session.lcm").string();
  }
  static std::string Marked() { return (*folder_ / "marked.lcm").string(); }
  static Outcome Replay(const std::string& log, const std::string& out,
                        const std::string& options = "") {
    return RunCommand("pangea-session replay " + log + " --out " + (*folder_ / out).string() + " " +
                      options);
  }
  static fs::path* folder_;
};
fs::path* ReplayCheckpoint::folder_ = nullptr;

void ExpectMarkedUpToCheckpoint(const Marks& marks) {
  EXPECT_GT(marks.marked, 10);
  EXPECT_GT(marks.others, 10);
  // The next keyframe may be a second away.
  EXPECT_NEAR(marks.last_marked_s, kCheckpoint_s, 1);
  EXPECT_LT(marks.last_marked_s, marks.first_other_s);
}

// The result has the same bytes as the whole replay, though its beginning was not verified again.
TEST_F(ReplayCheckpoint, TheRestIsAsInTheWhole) {
  const Outcome rest = Replay(Log("whole"), "rest", "--from-checkpoint 6 --diff " + Log("whole"));
  EXPECT_EQ(rest.exit_code, 0) << rest.output;
  EXPECT_THAT(rest.output, AllOf(HasSubstr("matches and verification results of the first 6 s"),
                                 HasSubstr("## Groups"), HasSubstr("no message differs")));
}

TEST_F(ReplayCheckpoint, UpToItTheLogsMessagesCount) {
  const Outcome rest = Replay(Marked(), "of_all", "--from-checkpoint 6 --until 8");
  EXPECT_EQ(rest.exit_code, 0) << rest.output;
  const MarksOf marks = ReadMarks(Log("of_all"));
  ExpectMarkedUpToCheckpoint(marks.matches);
  ExpectMarkedUpToCheckpoint(marks.results);
}

TEST_F(ReplayCheckpoint, OfOneProcess) {
  const Outcome rest = Replay(Marked(), "of_one", "--from-checkpoint 6 --until 8 --only fusion");
  EXPECT_EQ(rest.exit_code, 2) << rest.output;  // the computed results differ from the marked ones
  const MarksOf marks = ReadMarks(Log("of_one"));
  ExpectMarkedUpToCheckpoint(marks.results);
  EXPECT_EQ(marks.matches.others, 0);
}

// In a live session verification results are late: those that the log does not have at the
// checkpoint are computed.
TEST_F(ReplayCheckpoint, OfALiveSessionNothingIsLostOrSaidTwice) {
  const Outcome rest = Replay(kSample, "live", "--from-checkpoint 6 --until 8");
  EXPECT_EQ(rest.exit_code, 0) << rest.output;
  const MarksOf marks = ReadMarks(Log("live"));
  EXPECT_GT(marks.candidates, 20);
  EXPECT_EQ(marks.results.others, marks.candidates);
  EXPECT_EQ(std::ssize(marks.constraint_ids), marks.candidates);
}

TEST_F(ReplayCheckpoint, NotWhereItCannotBe) {
  const std::string keyframes = (*folder_ / "keyframes.lcm").string();
  RunCommand("pangea-log cut " + kSample + " --channels 'KEYFRAME_.*' --out " + keyframes);
  const auto expect_error = [](const std::string& logs, const char* at, const char* why) {
    const Outcome outcome = Replay(logs, "none", std::string("--from-checkpoint ") + at);
    EXPECT_EQ(outcome.exit_code, 1) << outcome.output;
    EXPECT_THAT(outcome.output, HasSubstr(why));
  };
  expect_error(keyframes, "6", "no match and no verification result before the checkpoint");
  expect_error(kSample, "100", "no keyframe comes after it");
  expect_error(kSample + " " + keyframes, "6", "takes one log");
}

}  // namespace
}  // namespace pangea::tests
