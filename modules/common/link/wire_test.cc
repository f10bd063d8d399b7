#include "common/link/wire.h"

#include <gtest/gtest.h>

#include <functional>

namespace pangea {
namespace {

LinkPacket GoodPacket(int index) {
  LinkPacket packet;
  packet.agent_id = 2;
  packet.run = 5;
  packet.number = 9;
  packet.kind = LinkPacket::Kind::kKeyframe;
  packet.keyframe = {{2, 100}, 7};
  packet.index = index;
  packet.count = 3;
  packet.total_bytes = 2500;
  packet.data.resize(index == 2 ? 500 : 1000, 3);
  return packet;
}

TEST(Wire, Crc32IsTheUsualOne) {
  const std::string text = "123456789";
  EXPECT_EQ(Crc32({reinterpret_cast<const uint8_t*>(text.data()), text.size()}), 0xCBF43926u);
}

TEST(Wire, PacketRoundTrip) {
  for (const int index : {0, 1, 2}) {
    const auto parsed = Parse(ToMessage(GoodPacket(index)));
    ASSERT_TRUE(parsed.value) << parsed.refused;
    EXPECT_EQ(parsed.value->keyframe, (KeyframeId{{2, 100}, 7}));
    EXPECT_EQ(parsed.value->offset, 1000 * index);
    EXPECT_EQ(parsed.value->data, GoodPacket(index).data);
  }
}

TEST(Wire, AbsurdPacketsAreRefused) {
  const std::vector<std::function<void(link_packet_t*)>> damages = {
      [](link_packet_t* m) { m->agent_id = 0; },
      [](link_packet_t* m) { m->agent_id = 3; },
      [](link_packet_t* m) { m->run = 0; },
      [](link_packet_t* m) { m->number = -4; },
      [](link_packet_t* m) { m->kind = 0; },
      [](link_packet_t* m) { m->kind = 77; },
      [](link_packet_t* m) { m->keyframe.seq = -1; },
      [](link_packet_t* m) { m->index = -1; },
      [](link_packet_t* m) { m->index = 3; },
      [](link_packet_t* m) { m->count = 0; },
      [](link_packet_t* m) { m->count = 30000; },
      [](link_packet_t* m) { m->total_bytes = -1; },
      [](link_packet_t* m) { m->total_bytes = 2'000'000'000; },
      [](link_packet_t* m) { m->total_bytes = 1; },
      [](link_packet_t* m) { m->total_bytes = 3001; },
      [](link_packet_t* m) { m->num_bytes = 0; },
  };
  for (const int index : {0, 2}) {
    for (size_t i = 0; i < damages.size(); ++i) {
      link_packet_t bad = ToMessage(GoodPacket(index));
      damages[i](&bad);
      const auto parsed = Parse(bad);
      EXPECT_FALSE(parsed.value) << "index " << index << " damage " << i;
      EXPECT_FALSE(parsed.refused.empty());
    }
  }
}

// Whatever passes Parse must lie within the message.
TEST(Wire, AcceptedPiecesLieInTheMessage) {
  for (int total = 1; total < 60; ++total) {
    for (int count = 1; count < 8; ++count) {
      for (int index = 0; index < count; ++index) {
        for (int size = 1; size < 40; ++size) {
          LinkPacket packet = GoodPacket(0);
          packet.index = index;
          packet.count = count;
          packet.total_bytes = total;
          packet.data.resize(static_cast<size_t>(size));
          const auto parsed = Parse(ToMessage(packet));
          if (parsed.value) {
            EXPECT_LE(parsed.value->offset + size, total);
            EXPECT_EQ(index == count - 1, parsed.value->offset + size == total);
          }
        }
      }
    }
  }
}

TEST(Wire, AckRoundTripAndRefusal) {
  LinkAck ack;
  ack.agent_id = 2;
  ack.run = 1;
  ack.number = 2;
  ack.uplink_run = 3;
  ack.highest_number = 4;
  ack.cache_bytes = 1000;
  ack.journalled_seq = {{{2, 100}, -1}, {{2, 200}, 9}};
  ack.partial[{{2, 200}, 10}] = {0xFF, 0x01};
  Correction correction;
  correction.map = {2, 200};
  correction.group = {1, 50};
  correction.revision = 3;
  ack.corrections.push_back(correction);
  const auto parsed = Parse(ToMessage(ack));
  ASSERT_TRUE(parsed.value) << parsed.refused;
  EXPECT_EQ(parsed.value->journalled_seq, ack.journalled_seq);
  EXPECT_EQ(parsed.value->partial, ack.partial);
  EXPECT_EQ(parsed.value->corrections[0].revision, 3);
  ack.corrections[0].map.agent_id = 1;
  EXPECT_FALSE(Parse(ToMessage(ack)).value);
}

}  // namespace
}  // namespace pangea
