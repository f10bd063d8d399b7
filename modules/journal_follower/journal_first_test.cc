#include "journal_follower/journal_first.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace pangea {
namespace {

TEST(JournalFirstBus, DeliversHaveBeforeWhatCameBeforeIt) {
  LocalBus local;
  JournalFirstBus bus(local, 0);
  std::vector<std::string> seen;
  bus.Subscribe("KEYFRAME_1|PLACE_MATCH", [&](const std::string& c, Bytes) { seen.push_back(c); });
  bus.Subscribe("HAVE", [&](const std::string& channel, Bytes) { seen.push_back(channel); });
  for (const char* channel : {"KEYFRAME_1", "PLACE_MATCH", "HAVE", "KEYFRAME_1"}) {
    local.Publish(channel, {});
  }
  local.Drain();
  EXPECT_THAT(seen, testing::ElementsAre("HAVE"));
  bus.Poll(1000);
  EXPECT_THAT(seen, testing::ElementsAre("HAVE", "KEYFRAME_1", "PLACE_MATCH", "KEYFRAME_1"));
  local.Publish("PLACE_MATCH", {});
  local.Drain();
  EXPECT_EQ(seen.size(), 5u);
}

TEST(JournalFirstBus, WaitsNotForEverWhereThereIsNoJournal) {
  LocalBus local;
  JournalFirstBus bus(local, 0);
  int seen = 0;
  bus.Subscribe("KEYFRAME_1", [&](const std::string&, Bytes) { ++seen; });
  local.Publish("KEYFRAME_1", {});
  local.Drain();
  bus.Poll(JournalFirstBus::kLongest_us - 1);
  EXPECT_EQ(seen, 0);
  bus.Poll(JournalFirstBus::kLongest_us);
  EXPECT_EQ(seen, 1);
}

}  // namespace
}  // namespace pangea
