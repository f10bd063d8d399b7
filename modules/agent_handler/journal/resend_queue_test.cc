#include "agent_handler/journal/resend_queue.h"

#include <gtest/gtest.h>

#include <map>

#include "messages/channels.h"
#include "messages/messages.h"

namespace pangea {
namespace {

constexpr int kKeyframes = 20;  // of each map

MapId Map(int i) { return {1, 1000 + i}; }

JournalIndex IndexOf(int maps) {
  JournalIndex index;
  for (int map = 0; map < maps; ++map) {
    for (int seq = 0; seq < kKeyframes; ++seq) {
      index.AddKeyframe({Map(map), seq}, {100 * map + seq, 10, 0});
    }
  }
  return index;
}

resend_request_t Request(const std::string& requester, const MapId& map) {
  resend_request_t request{};
  request.requester = requester;
  request.channel = channels::Keyframe(map.agent_id);
  request.map = ToMessage(map);
  request.to_seq = kKeyframes - 1;
  return request;
}

// As six followers of a site with many maps: the last one does not wait for the others' maps.
TEST(ResendQueue, RequestersTakeTurns) {
  constexpr int kMaps = 160;
  const JournalIndex index = IndexOf(kMaps);
  ResendQueue queue;
  const std::vector<std::string> requesters = {"a", "b", "c", "d", "e", "f"};
  for (const std::string& requester : requesters) {
    for (int map = 0; map < kMaps; ++map) {
      EXPECT_EQ(queue.Add(Request(requester, Map(map)), index), "") << requester << map;
    }
  }
  std::map<std::string, int> answered;
  for (int i = 0; i < 600; ++i) {
    const auto answer = queue.Next(index);
    ASSERT_TRUE(answer);
    EXPECT_EQ(answer->places.size(), 1u);
    ++answered[answer->requester];
  }
  for (const std::string& requester : requesters) {
    EXPECT_EQ(answered[requester], 100) << requester;
  }
  for (int i = 600; i < 6 * kMaps * kKeyframes; ++i) {
    ASSERT_TRUE(queue.Next(index));
  }
  EXPECT_FALSE(queue.Next(index));
  EXPECT_EQ(queue.waiting(), 0u);
}

TEST(ResendQueue, OneThatIsCoveredIsDropped) {
  const JournalIndex index = IndexOf(1);
  ResendQueue queue;
  EXPECT_EQ(queue.Add(Request("a", Map(0)), index), "");
  EXPECT_EQ(queue.Add(Request("a", Map(0)), index), "");
  EXPECT_EQ(queue.waiting(), 1u);
  EXPECT_EQ(queue.Add(Request("b", Map(0)), index), "");
  EXPECT_EQ(queue.waiting(), 2u);
}

TEST(ResendQueue, IsBounded) {
  const auto maps = static_cast<int>(ResendQueue::kMaxRequests) + 1;
  const JournalIndex index = IndexOf(maps);
  ResendQueue queue;
  for (int map = 0; map + 1 < maps; ++map) {
    ASSERT_EQ(queue.Add(Request("a", Map(map)), index), "");
  }
  EXPECT_NE(queue.Add(Request("a", Map(maps - 1)), index), "");
  for (size_t i = 1; i < ResendQueue::kMaxRequesters; ++i) {
    ASSERT_EQ(queue.Add(Request("b" + std::to_string(i), Map(0)), index), "");
  }
  EXPECT_NE(queue.Add(Request("one_more", Map(0)), index), "");
}

}  // namespace
}  // namespace pangea
