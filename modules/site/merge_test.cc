#include "site/merge.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>

#include "files/text_file.h"
#include "log_file/log_reader.h"
#include "messages/anchor_messages.h"
#include "messages/channels.h"
#include "messages/encoding.h"
#include "messages/messages.h"
#include "replay/replay.h"
#include "report/metrics/report_groups.h"
#include "site/site_test_world.h"

namespace pangea::site {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

int Count(const std::vector<StoredEvent>& events, const std::string& channel) {
  return static_cast<int>(std::ranges::count(events, channel, &StoredEvent::channel));
}

class MergeTest : public testing::Test {
 protected:
  const fs::path folder = FreshFolder("merge");
  const Site first = MakeSite(folder / "first", WalksOf({1}));
  const Site second = MakeSite(folder / "second", WalksOf({2}));
  const fs::path out = folder / "both";
};

TEST_F(MergeTest, HasAllOfTheFirstAndBehindItTheSecondsKeyframes) {
  const MergeSummary summary = MergeSites(first, second, out, {});
  EXPECT_EQ(summary.keyframes_first, 32);
  EXPECT_EQ(summary.keyframes_second, 31);
  const std::vector<StoredEvent> merged = EventsOf(ReadSite(out));
  const std::vector<StoredEvent> of_first = EventsOf(first);
  ASSERT_EQ(merged.size(), of_first.size() + 31);
  EXPECT_TRUE(std::equal(of_first.begin(), of_first.end(), merged.begin()));
  EXPECT_EQ(Count(merged, "KEYFRAME_2"), 31);
  // Both walks were captured at the same time, and times must not decrease.
  EXPECT_TRUE(std::ranges::is_sorted(merged, {}, &StoredEvent::utime));
  EXPECT_EQ(FoundAtOpening(ReadSite(out)), "");
  EXPECT_EQ(ReadSite(out).description.name, "both");
}

// With both walks the server finds that the maps overlap, and makes them one group.
TEST_F(MergeTest, TheServerFusesTheMapsOfBoth) {
  MergeSites(first, second, out, {});
  Progress progress("test");
  Replay({out / "journal.lcm"}, {}, 1e9, folder / "replay.lcm", progress);
  const auto groups = FinalGroups(ReadServerLog(folder / "replay.lcm"));
  ASSERT_EQ(groups.size(), 1u);
  EXPECT_EQ(groups[0].Agents(), (std::vector<int32_t>{1, 2}));
  EXPECT_EQ(groups[0].keyframes.size(), 63u);
}

TEST_F(MergeTest, NeedsTwoSites) {
  const Site a = MakeSite(folder / "a", {EditEvent({1, 7}, 1, 0)});
  EXPECT_THAT(WhyNot([&] { MergeSites(a, ReadSite(folder / "a" / ""), out, {}); }),
              testing::HasSubstr("are one site: give two"));
  EXPECT_FALSE(fs::exists(out));
}

TEST_F(MergeTest, NumbersAnchorEditsOn) {
  const Site a = MakeSite(folder / "a", {EditEvent({1, 7}, 1, 0), EditEvent({1, 7}, 2, 1)});
  // Edits with one revision by two agents are both kept.
  StoredEvent by_another = EditEvent({1, 7}, 2, 6);
  anchor_edit_t message{};
  ASSERT_TRUE(DecodeMessage(by_another.data, &message));
  message.agent_id = 2;
  by_another.data = EncodeMessage(message);
  const Site b = MakeSite(folder / "b", {EditEvent({2, 7}, 1, 0), EditEvent({1, 7}, 1, 1),
                                         EditEvent({2, 8}, 1, 5), by_another});
  EXPECT_EQ(MergeSites(a, b, out, {}).anchor_edits, 5);
  int64_t next = 0;
  for (const StoredEvent& event : EventsOf(ReadSite(out))) {
    anchor_edit_t edit{};
    ASSERT_TRUE(DecodeMessage(event.data, &edit));
    EXPECT_EQ(edit.seq, next++);
  }
  EXPECT_EQ(next, 5);
}

TEST_F(MergeTest, KeepsResultsBetweenTheSecondsMaps) {
  const Site empty = MakeSite(folder / "empty", {});
  MergeSites(empty, MakeSite(folder / "walks", WalksOf({1, 2})), out, {});
  const std::vector<StoredEvent> merged = EventsOf(ReadSite(out));
  EXPECT_EQ(Count(merged, "PLACE_MATCH"), 0);
  EXPECT_GT(Count(merged, "CONSTRAINT"), 10);
  for (const StoredEvent& event : merged) {
    constraint_t constraint{};
    if (event.channel == channels::kConstraint) {
      ASSERT_TRUE(DecodeMessage(event.data, &constraint));
      EXPECT_NE(constraint.from.map.agent_id, constraint.to.map.agent_id);
    }
  }
}

TEST_F(MergeTest, KeepsWhatAThinningDerivedWithinAMap) {
  std::vector<StoredEvent> walk = WalksOf({2});
  KeyframeMessage keyframe{};
  ASSERT_TRUE(DecodeMessage(walk.front().data, &keyframe));
  Constraint derived;
  derived.from = *Parse(keyframe.id).value;
  derived.to = derived.from;
  ++derived.to.seq;
  derived.kind = PlaceKind::kDerived;
  derived.accepted = true;
  walk.push_back({walk.back().utime, "CONSTRAINT", EncodeMessage(ToMessage(derived))});
  MergeSites(first, MakeSite(folder / "thinned", walk), out, {});
  EXPECT_TRUE(std::ranges::any_of(EventsOf(ReadSite(out)), [&walk](const StoredEvent& event) {
    return event.data == walk.back().data;
  }));
}

TEST_F(MergeTest, TakesAMapThatIsTheSameInBothOnce) {
  const MergeSummary summary =
      MergeSites(first, MakeSite(folder / "walks", WalksOf({1, 2})), out, {});
  EXPECT_EQ(summary.maps_in_both, 1);
  EXPECT_EQ(Count(EventsOf(ReadSite(out)), "KEYFRAME_1"), 32);
}

TEST_F(MergeTest, RefusesAMapThatDiffers) {
  std::vector<StoredEvent> fewer = WalksOf({1});
  std::erase_if(fewer, [left = 3](const StoredEvent& event) mutable {
    return event.channel == "KEYFRAME_1" && left-- > 0;
  });
  const Site other = MakeSite(folder / "other", fewer);
  EXPECT_THAT(WhyNot([&] { MergeSites(first, other, out, {}); }),
              HasSubstr("and is not the same in both"));
  EXPECT_FALSE(fs::exists(out));
}

TEST_F(MergeTest, LeavesNothingOnAFullDisk) {
  EXPECT_THAT(OnFullDisk(1'000'000, [&] { MergeSites(first, second, out, {}); }),
              HasSubstr("cannot be written"));
  EXPECT_EQ(std::distance(fs::directory_iterator(folder), fs::directory_iterator()), 2);
}

TEST_F(MergeTest, BringsTheFirstsOptionsAndKeysIfWanted) {
  std::ofstream(first.options() / "fusion.yaml") << "{}\n";
  std::ofstream(second.options() / "posegraph.yaml") << "{}\n";
  std::ofstream(first.keys() / "agent_1.key") << "one";
  std::ofstream(second.keys() / "agent_1.key") << "one";
  std::ofstream(second.keys() / "agent_2.key") << "two";
  for (const Site& site : {first, second}) {
    fs::create_directories(site.gateway() / "agents");
    std::ofstream(site.gateway() / "agents" / "1001.json") << site.description.name;
  }
  std::ofstream(second.gateway() / "agents" / "1002.json") << "Ben";
  MergeSites(first, second, folder / "no_keys", {});
  EXPECT_TRUE(fs::is_empty(folder / "no_keys/keys"));
  EXPECT_EQ(ReadTextFile(folder / "no_keys/gateway/agents/1001.json"), first.description.name);
  EXPECT_EQ(ReadTextFile(folder / "no_keys/gateway/agents/1002.json"), "Ben");
  MergeSites(first, second, out, {.name = "Both", .with_keys = true});
  EXPECT_EQ(ReadSite(out).description.name, "Both");
  EXPECT_TRUE(fs::exists(out / "options/fusion.yaml"));
  EXPECT_FALSE(fs::exists(out / "options/posegraph.yaml"));
  EXPECT_EQ(ReadTextFile(out / "keys/agent_2.key"), "two");
  std::ofstream(second.keys() / "agent_1.key") << "other";
  EXPECT_THAT(
      WhyNot([&] { MergeSites(first, second, folder / "x", {.name = "", .with_keys = true}); }),
      HasSubstr("is another key than the other site's"));
  EXPECT_FALSE(fs::exists(folder / "x"));
}

}  // namespace
}  // namespace pangea::site
