#include "site/thinned_journal.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <set>

#include "messages/channels.h"
#include "messages/encoding.h"
#include "messages/messages.h"
#include "replay/keyframe_log.h"
#include "site/compact.h"
#include "site/site_test_world.h"

namespace pangea::site {
namespace {

using testing::HasSubstr;

std::map<MapId, std::set<int32_t>> KeyframesOf(const std::vector<StoredEvent>& events) {
  std::map<MapId, std::set<int32_t>> keyframes;
  for (const StoredEvent& event : events) {
    KeyframeMessage message{};
    if (event.channel.starts_with(channels::kKeyframePrefix) &&
        DecodeMessage(event.data, &message)) {
      const KeyframeId id = *Parse(message.id).value;
      keyframes[id.map].insert(id.seq);
    }
  }
  return keyframes;
}

TEST(ThinnedJournal, SaysNothingOfKeyframesThatWent) {
  const std::vector<StoredEvent> before = WalksAgainAndAgain();
  const Site site = MakeSite(FreshFolder("thin") / "hall", before);
  const CompactSummary summary = Compact(site, AfterTheLast(before));
  const std::vector<StoredEvent> after = EventsOf(site);
  EXPECT_EQ(FoundAtOpening(site), "");
  EXPECT_GT(summary.keyframes_gone, 60);
  EXPECT_GT(summary.constraints_derived, 0);
  EXPECT_LT(summary.bytes_after, 0.8 * static_cast<double>(summary.bytes_before));

  const auto keyframes = KeyframesOf(after);
  const auto is_there = [&keyframes](const KeyframeId& id) {
    const auto map = keyframes.find(id.map);
    return map != keyframes.end() && map->second.contains(id.seq);
  };
  std::set<KeyframeId> matched;
  for (const StoredEvent& event : after) {
    if (event.channel == channels::kPlaceMatch) {
      place_match_t message{};
      DecodeMessage(event.data, &message);
      const PlaceMatch match = *Parse(message).value;
      EXPECT_TRUE(is_there(match.query));
      EXPECT_TRUE(matched.insert(match.query).second);
      for (const PlaceCandidate& candidate : match.candidates) {
        EXPECT_TRUE(is_there(candidate.match));
      }
    } else if (event.channel == channels::kConstraint) {
      constraint_t message{};
      DecodeMessage(event.data, &message);
      const Constraint constraint = *Parse(message).value;
      EXPECT_TRUE(is_there(constraint.from) && is_there(constraint.to));
    }
  }
  size_t num_keyframes = 0;
  for (const auto& [map, seqs] : keyframes) {
    num_keyframes += seqs.size();
  }
  EXPECT_EQ(matched.size(), num_keyframes) << "each has its match";
  // A replay accepts the journal: edges lead over the gaps.
  EXPECT_EQ(ReadKeyframeLog(site.journal()).size(), num_keyframes);
}

TEST(ThinnedJournal, ThinnedAgainItStaysAsItIs) {
  const std::vector<StoredEvent> before = WalksAgainAndAgain();
  const Site site = MakeSite(FreshFolder("thin_again") / "hall", before);
  const CompactSummary first = Compact(site, AfterTheLast(before));
  const CompactSummary second = Compact(site, AfterTheLast(before));
  EXPECT_LE(second.keyframes_gone, first.keyframes_gone / 20);
  EXPECT_NEAR(second.events_after, first.events_after, 0.05 * first.events_after);
}

TEST(ThinnedJournal, ASiteOfFewVisitsStaysAsItIs) {
  const std::vector<StoredEvent> before = WalksOf({1, 2});
  const Site site = MakeSite(FreshFolder("thin_few") / "hall", before);
  EXPECT_EQ(Compact(site, AfterTheLast(before)).keyframes_gone, 0);
  EXPECT_EQ(EventsOf(site), before);
}

TEST(ThinnedJournal, LeavesTheOldOneWhenTheDiskIsFull) {
  const std::vector<StoredEvent> before = WalksAgainAndAgain();
  const Site site = MakeSite(FreshFolder("thin_full") / "hall", before);
  EXPECT_THAT(OnFullDisk(300'000, [&] { Compact(site, AfterTheLast(before)); }),
              HasSubstr("journal.lcm.compacting: cannot be written: File too large"));
  EXPECT_EQ(EventsOf(site), before);
}

}  // namespace
}  // namespace pangea::site
