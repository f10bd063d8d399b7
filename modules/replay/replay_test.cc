#include "replay/replay.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sstream>

#include "log_file/log_reader.h"
#include "log_file/log_writer.h"
#include "messages/anchor_messages.h"
#include "messages/encoding.h"
#include "messages/messages.h"
#include "replay/keyframe_log.h"

namespace pangea {
namespace {

using testing::EndsWith;
using testing::HasSubstr;

const std::filesystem::path kSample =
    std::filesystem::path(PANGEA_SOURCE_DIR) / "logs" / "two_walks" / "session.lcm";
constexpr double kUntil_s = 3;

// The progress that a replay prints if ten seconds pass between any two queries of the clock.
template <typename Run>
std::string Told(Run run) {
  std::ostringstream out;
  double now_s = 0;
  Progress progress("replay", out, false, [&now_s] { return now_s += 10; });
  run(progress);
  return out.str();
}

TEST(Replay, TellsHowFarItIs) {
  const std::string log = testing::TempDir() + "replay_progress.lcm";
  int64_t keyframes = 0;
  const std::string whole = Told([&](Progress& progress) {
    keyframes = Replay({kSample}, {}, kUntil_s, log, progress).keyframes;
  });
  ASSERT_GT(keyframes, 1);
  EXPECT_THAT(whole, HasSubstr(fmt::format("replay: 1 of {0} keyframes\n", keyframes)));
  EXPECT_THAT(whole, EndsWith(fmt::format("replay: {0} of {0} keyframes\n", keyframes)));
  ReplayedPart posegraph;
  posegraph.processes = {"posegraph"};
  const std::string part =
      Told([&](Progress& progress) { ReplayPart(log, posegraph, log + ".part", progress); });
  EXPECT_THAT(part, HasSubstr("replay: 1 of "));
  EXPECT_THAT(part, EndsWith(" messages\n"));
  std::filesystem::remove(log);
  std::filesystem::remove(log + ".part");
}

// A server that started long before its agents: times are since the log's first event.
TEST(Replay, BeginsAtTheLogsFirstEvent) {
  constexpr int64_t kEarlier_us = 100'000'000;
  const std::string late = testing::TempDir() + "replay_late.lcm", out = late + ".out";
  {
    LogFileWriter log(late);
    LogReader sample(kSample.string());
    const LogEvent* event = sample.Next();
    log.Write(event->utime - kEarlier_us, "SOMETHING", std::vector<uint8_t>{1});
    for (; event != nullptr; event = sample.Next()) {
      log.Write(event->utime, event->channel, event->data);
    }
  }
  Progress progress("replay");
  Replay({late}, {}, 1e-6 * kEarlier_us + kUntil_s, out, progress);
  LogReader replayed(out);
  const int64_t begin_utime = replayed.Next()->utime;
  const LogEvent* event = replayed.Next();
  while (event != nullptr && event->channel != "KEYFRAME_1") {
    event = replayed.Next();
  }
  ASSERT_NE(event, nullptr);
  EXPECT_GE(event->utime - begin_utime, kEarlier_us);
  std::filesystem::remove(late);
  std::filesystem::remove(out);
}

TEST(Replay, AMapInTwoLogsIsRefused) {
  const std::string copy = testing::TempDir() + "replay_copy.lcm", out = copy + ".out";
  std::filesystem::copy_file(kSample, copy, std::filesystem::copy_options::overwrite_existing);
  Progress progress("replay");
  EXPECT_THAT(
      [&] {
        Replay({kSample, copy}, {}, kUntil_s, out, progress);
      },
      testing::ThrowsMessage<std::runtime_error>(HasSubstr("replay_copy.lcm both have")));
  std::filesystem::remove(copy);
}

// Bytes of the messages on a channel, in the log's order.
std::vector<std::vector<uint8_t>> On(const std::string& channel, const std::string& log) {
  std::vector<std::vector<uint8_t>> all;
  ReadLog(log, [&](const LogEvent& event) {
    if (event.channel == channel) {
      all.emplace_back(event.data.begin(), event.data.end());
    }
  });
  return all;
}

// Each match between maps gets a candidate in the keyframe's own map, too.
LogEvent WithCandidateInOwnMap(const LogEvent& event, std::vector<uint8_t>* data) {
  place_match_t message{};
  if (event.channel != "PLACE_MATCH" || !DecodeMessage(event.data, &message)) {
    return event;
  }
  PlaceMatch match = *Parse(message).value;
  if (!match.candidates.empty() && match.query.seq > 0) {
    PlaceCandidate candidate;
    candidate.match = {match.query.map, 0};
    candidate.kind = PlaceKind::kIntra;
    match.candidates.insert(match.candidates.begin(), candidate);
  }
  *data = EncodeMessage(ToMessage(match));
  return {.utime = event.utime, .channel = event.channel, .data = *data};
}

// Results of both verifying processes for one match, of which only one process runs again.
TEST(Replay, OfOneVerifierKeepsTheOrderOfResults) {
  const std::string log = testing::TempDir() + "replay_order.lcm";
  std::ostringstream out;
  Progress progress("replay", out, false, [] { return 0.0; });
  Replay({kSample}, {}, kUntil_s, log, progress);
  {
    LogFileWriter file(log + ".both");
    ReadLog(log, [&](const LogEvent& event) {
      std::vector<uint8_t> data;
      const LogEvent written = WithCandidateInOwnMap(event, &data);
      file.Write(written.utime, written.channel, written.data);
    });
  }
  ReplayedPart part;
  part.processes = {"inter_map_ba", "fusion"};
  ReplayPart(log + ".both", part, log + ".1", progress);
  ASSERT_GT(On("CONSTRAINT", log + ".1").size(), On("CONSTRAINT", log).size());
  for (const char* process : {"inter_map_ba", "fusion"}) {
    part.processes = {process};
    ReplayPart(log + ".1", part, log + ".part", progress);
    EXPECT_EQ(On("CONSTRAINT", log + ".part"), On("CONSTRAINT", log + ".1")) << process;
  }
  for (const char* suffix : {"", ".both", ".1", ".part"}) {
    std::filesystem::remove(log + suffix);
  }
}

// The sample's first seconds, with an anchor that agent 1 placed after one of its keyframes.
class ReplayOfAnchors : public testing::Test {
 protected:
  ReplayOfAnchors() {
    std::filesystem::remove(log_);
    LogFileWriter file(log_);
    const auto keyframes = ReadKeyframeLog(kSample);
    int64_t seq = 0;
    for (const LoggedKeyframe& keyframe : keyframes) {
      file.Write(keyframe.captured_utime, keyframe.channel, keyframe.data);
      if (keyframe.id.seq == 2) {
        file.Write(keyframe.captured_utime, "ANCHOR_EDIT", EncodeMessage(EditAt(keyframe.id, seq)));
        // agent_handler repeats the newest edit in the same way.
        file.Write(keyframe.captured_utime, "ANCHOR_EDIT", EncodeMessage(EditAt(keyframe.id, seq)));
        ++seq;
      }
    }
  }
  ~ReplayOfAnchors() override {
    for (const char* suffix : {"", ".1", ".2", ".part"}) {
      std::filesystem::remove(log_ + suffix);
    }
  }

  static anchor_edit_t EditAt(const KeyframeId& keyframe, int64_t seq) {
    AnchorEdit edit;
    edit.anchor = {keyframe.map.agent_id, 1};
    edit.agent_id = keyframe.map.agent_id;
    edit.right = AnchorRight::kEditOwn;
    edit.seq = seq;
    edit.name = "kettle";
    edit.placement = AnchorEdit::Placement::kKeyframe;
    edit.map = keyframe.map;
    edit.keyframe_seq = keyframe.seq;
    edit.T_ref_anchor.t = {1, 0, 0};
    return ToMessage(edit);
  }
  const std::string log_ = testing::TempDir() + "replay_anchors.lcm";
  std::ostringstream out_;
  Progress progress_{"replay", out_, false, [] { return 0.0; }};
};

TEST_F(ReplayOfAnchors, PlacesThemAgainTheSame) {
  Replay({log_}, {}, kUntil_s, log_ + ".1", progress_);
  const auto anchors = On("ANCHOR", log_ + ".1");
  ASSERT_FALSE(anchors.empty());
  anchor_t anchor{};
  ASSERT_TRUE(DecodeMessage(anchors[0], &anchor));
  EXPECT_EQ(anchor.name, "kettle");
  EXPECT_EQ(On("ANCHOR_EDIT", log_ + ".1").size(), anchors.size());

  Replay({log_ + ".1"}, {}, kUntil_s, log_ + ".2", progress_);
  EXPECT_EQ(On("ANCHOR", log_ + ".2"), anchors);
  ReplayedPart alone;
  alone.processes = {"anchors"};
  ReplayPart(log_ + ".1", alone, log_ + ".part", progress_);
  EXPECT_EQ(On("ANCHOR", log_ + ".part"), anchors);
}

// No process computes it again.
TEST_F(ReplayOfAnchors, TakesAlongWhatAThinningDerived) {
  const auto keyframes = ReadKeyframeLog(kSample);
  Constraint derived;
  derived.from = keyframes[0].id;
  derived.to = std::ranges::find_if(keyframes, [&](const LoggedKeyframe& keyframe) {
                 return keyframe.id.map != derived.from.map;
               })->id;
  derived.kind = PlaceKind::kDerived;
  derived.accepted = true;
  const std::vector<uint8_t> message = EncodeMessage(ToMessage(derived));
  {
    LogFileWriter file(log_);
    for (const LoggedKeyframe& keyframe : keyframes) {
      file.Write(keyframe.captured_utime, keyframe.channel, keyframe.data);
    }
    file.Write(keyframes.back().captured_utime, "CONSTRAINT", message);
  }
  Replay({log_}, {}, kUntil_s, log_ + ".1", progress_);
  EXPECT_THAT(On("CONSTRAINT", log_ + ".1"), testing::Contains(message));
  ReplayedPart posegraph;
  posegraph.processes = {"posegraph"};
  ReplayPart(log_, posegraph, log_ + ".part", progress_);
  EXPECT_THAT(On("CONSTRAINT", log_ + ".part"), testing::Contains(message));
}

}  // namespace
}  // namespace pangea
