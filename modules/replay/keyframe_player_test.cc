#include "replay/keyframe_player.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "messages/channels.h"
#include "messages/encoding.h"
#include "messages/messages.h"
#include "pangea/again_t.hpp"

namespace pangea {
namespace {

const MapId kMap{4, 1000};

std::vector<LoggedKeyframe> Keyframes(int count) {
  std::vector<LoggedKeyframe> keyframes;
  for (int seq = 0; seq < count; ++seq) {
    keyframes.push_back({"KEYFRAME_4",
                         {kMap, seq},
                         7'000'000 + int64_t{500'000} * seq,
                         {static_cast<uint8_t>(seq), 9}});
  }
  return keyframes;
}

class KeyframePlayerTest : public testing::Test {
 protected:
  KeyframePlayerTest() {
    bus_.Subscribe(channels::Keyframe(4),
                   [this](const std::string&, Bytes data) { played_.push_back(data[0]); });
    bus_.Subscribe(channels::Again("uplink_4"), [this](const std::string&, Bytes data) {
      again_t again{};
      ASSERT_TRUE(DecodeMessage(data, &again));
      EXPECT_EQ(again.channel, "KEYFRAME_4");
      again_.push_back(again.data[0]);
    });
  }
  void PlayAll(KeyframePlayer* player) {
    while (player->next_us()) {
      player->PlayNext();
    }
    bus_.Drain();
  }
  LocalBus bus_;
  std::vector<int> played_;
  std::vector<int> again_;
};

TEST_F(KeyframePlayerTest, PlaysInTheKeyframesOwnTime) {
  KeyframePlayer player(bus_, {4, 1, std::nullopt}, Keyframes(3), 0);
  EXPECT_EQ(player.next_us(), 0);
  player.PlayNext();
  EXPECT_EQ(player.next_us(), 500'000);
  PlayAll(&player);
  EXPECT_THAT(played_, testing::ElementsAre(0, 1, 2));
  EXPECT_EQ(player.publisher().Unacknowledged(), 3);
}

// A site's journal: the second map is of another day, and the third of another sensor clock.
TEST_F(KeyframePlayerTest, DoesNotWaitForDays) {
  std::vector<LoggedKeyframe> keyframes = Keyframes(4);
  keyframes[1].utime += 3'000'000;
  keyframes[2].utime += int64_t{86'400'000'000};
  keyframes[3].utime = 5;
  KeyframePlayer player(bus_, {4, 1, std::nullopt}, keyframes, 0);
  std::vector<int64_t> times_us;
  for (auto next = player.next_us(); next; next = player.next_us()) {
    times_us.push_back(*next);
    player.PlayNext();
  }
  EXPECT_THAT(times_us, testing::ElementsAre(0, 3'500'000, 13'500'000, 13'500'000));
  EXPECT_THAT(player.Plan(), testing::HasSubstr("4 keyframes, 14 s; 1 longer pauses take 10 s"));
}

TEST_F(KeyframePlayerTest, StopsAfterTheDuration) {
  KeyframePlayer player(bus_, {4, 1, 1.2}, Keyframes(10), 0);
  PlayAll(&player);
  EXPECT_THAT(played_, testing::ElementsAre(0, 1, 2));
}

TEST_F(KeyframePlayerTest, AnswersForWhatItHasPlayed) {
  KeyframePlayer player(bus_, {4, 1, std::nullopt}, Keyframes(4), 0);
  player.PlayNext();
  player.PlayNext();
  resend_request_t request{};
  request.requester = "uplink_4";
  request.channel = "KEYFRAME_4";
  request.map = ToMessage(kMap);
  request.from_seq = 1;
  request.to_seq = 3;
  PublishMessage(bus_, std::string(channels::kResendRequest), request);
  bus_.Drain();
  EXPECT_THAT(again_, testing::ElementsAre(1));

  have_t have{};
  have.num_maps = 1;
  have.maps = {ToMessage(kMap)};
  have.highest_seq = {0};
  PublishMessage(bus_, std::string(channels::kHave), have);
  bus_.Drain();
  EXPECT_EQ(player.publisher().Unacknowledged(), 1);
}

}  // namespace
}  // namespace pangea
