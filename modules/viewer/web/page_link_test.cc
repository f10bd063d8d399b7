#include "viewer/web/page_link.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <nlohmann/json.hpp>

#include "viewer/viewer_test_world.h"

namespace pangea::viewer {
namespace {

using nlohmann::json;

uint32_t WordAt(const std::vector<uint8_t>& bytes, size_t at) {
  uint32_t word = 0;
  std::memcpy(&word, bytes.data() + at, sizeof(word));
  return word;
}

float FloatAt(const std::vector<uint8_t>& bytes, size_t at) {
  float value = 0;
  std::memcpy(&value, bytes.data() + at, sizeof(value));
  return value;
}

json JsonOf(const std::vector<uint8_t>& bytes) {
  const uint32_t length = WordAt(bytes, 0);
  EXPECT_EQ(length % 4, 0U);
  return json::parse(bytes.begin() + 4, bytes.begin() + 4 + length);
}

// Takes all there is to take; the updates.
std::vector<json> TakeAll(PageLink& link) {
  std::vector<json> updates;
  while (const auto bytes = link.Next()) {
    updates.push_back(JsonOf(*bytes));
    EXPECT_TRUE(link.Receive(R"({"taken": 1})"));
  }
  return updates;
}

TEST(PageLink, TheLayoutIsWhatThePageReads) {
  TestShow show;
  show.scene_.Take(TestKeyframe(kOne, 3));
  show.scene_.Take(TestState({kOne}, 3, 1));
  PageLink link(show);
  const std::vector<uint8_t> bytes = link.Next().value();
  const json said = JsonOf(bytes);
  EXPECT_EQ(said["keyframes"], 1);
  EXPECT_EQ(said["solved"], 4);
  EXPECT_EQ(said["start"]["source"], "test");
  EXPECT_EQ(said["maps"][0]["agent"], 1);
  const size_t keyframe = 4 + WordAt(bytes, 0);
  EXPECT_EQ(WordAt(bytes, keyframe), 0U);       // index
  EXPECT_EQ(WordAt(bytes, keyframe + 4), 0U);   // map
  EXPECT_EQ(WordAt(bytes, keyframe + 8), 3U);   // seq
  EXPECT_EQ(WordAt(bytes, keyframe + 12), 1U);  // points
  EXPECT_EQ(FloatAt(bytes, keyframe + 16), 3.0F);
  EXPECT_EQ(FloatAt(bytes, keyframe + 28), 1.0F);  // qw
  EXPECT_EQ(FloatAt(bytes, keyframe + 52), 2.0F);  // the point's z
  EXPECT_EQ(bytes.size(), keyframe + 56 + 4 * 36);
}

TEST(PageLink, OneUpdateIsUnderWayAtATime) {
  TestShow show;
  show.scene_.Take(TestKeyframe(kOne, 0));
  PageLink link(show);
  EXPECT_TRUE(link.Next().has_value());
  show.scene_.Take(TestKeyframe(kOne, 1));
  EXPECT_FALSE(link.Next().has_value());
  EXPECT_TRUE(link.Receive(R"({"taken": 1})"));
  EXPECT_TRUE(link.Next().has_value());
  EXPECT_TRUE(link.Receive(R"({"taken": 2})"));
  EXPECT_FALSE(link.Next().has_value()) << "nothing is new";
}

// A value that changed a hundred times while a page was busy is sent once.
TEST(PageLink, ASlowPageIsToldTheNewestOnly) {
  TestShow show;
  PageLink link(show);
  TakeAll(link);
  ShownPose pose;
  pose.agent_id = 1;
  pose.state = "tracking";
  for (int i = 0; i < 100; ++i) {
    pose.num_tracked = i;
    show.scene_.Take(pose);
  }
  const std::vector<json> updates = TakeAll(link);
  ASSERT_EQ(updates.size(), 1U);
  ASSERT_EQ(updates[0]["agents"].size(), 1U);
  EXPECT_EQ(updates[0]["agents"][0]["num_tracked"], 99);
}

TEST(PageLink, MuchIsSentInPieces) {
  TestShow show;
  for (int32_t seq = 0; seq < 20'000; ++seq) {
    show.scene_.Take(TestKeyframe(kOne, seq));
  }
  PageLink link(show);
  const std::vector<json> updates = TakeAll(link);
  EXPECT_GT(updates.size(), 3U);
  int keyframes = 0;
  for (const json& update : updates) {
    keyframes += update["keyframes"].get<int>();
  }
  EXPECT_EQ(keyframes, 20'000);
  EXPECT_TRUE(updates[0].contains("start"));
  EXPECT_FALSE(updates[1].contains("start"));
}

TEST(PageLink, AnotherEpochBeginsAnew) {
  TestShow show;
  show.scene_.Take(TestKeyframe(kOne, 0));
  PageLink link(show);
  TakeAll(link);
  show.epoch_ = 2;
  const std::vector<json> updates = TakeAll(link);
  ASSERT_EQ(updates.size(), 1U);
  EXPECT_TRUE(updates[0].contains("start"));
  EXPECT_EQ(updates[0]["keyframes"], 1);
}

TEST(PageLink, ARefusalComesWithItsReasonWhateverItsBytes) {
  TestShow show;
  Constraint refused = TestConstraint({kOne, 0}, {kTwo, 1}, false);
  refused.reason = "\xff<b>";
  show.scene_.Take(refused);
  PageLink link(show);
  const json said = JsonOf(link.Next().value())["constraints"][0];
  EXPECT_EQ(said["accepted"], false);
  EXPECT_EQ(said["reason"], "\xEF\xBF\xBD<b>");
  EXPECT_EQ(said["from"], json({0, 0}));
  EXPECT_EQ(said["to"], json({1, 1}));
}

TEST(PageLink, OnlyTheWatchedCameraIsSent) {
  TestShow show;
  ShownKeyframe keyframe = TestKeyframe(kOne, 0);
  keyframe.corners = {kOne, 0, 0, 752, 480, {{7, Eigen::Vector2f(30, 40)}}};
  show.scene_.Take(keyframe);
  PageLink link(show);
  EXPECT_FALSE(TakeAll(link)[0].contains("view"));
  EXPECT_TRUE(link.Receive(R"({"watch": 2})"));
  EXPECT_FALSE(link.Next().has_value());
  EXPECT_TRUE(link.Receive(R"({"watch": 1})"));
  const std::vector<uint8_t> bytes = link.Next().value();
  EXPECT_EQ(JsonOf(bytes)["view"]["width"], 752);
  const size_t view = 4 + WordAt(bytes, 0);
  EXPECT_EQ(WordAt(bytes, view), 1U);      // tracks
  EXPECT_EQ(WordAt(bytes, view + 4), 1U);  // pixels of the first
  EXPECT_EQ(FloatAt(bytes, view + 8), 30.0F);
  EXPECT_EQ(FloatAt(bytes, view + 12), 40.0F);
  EXPECT_EQ(WordAt(bytes, view + 16), 0U);  // bytes of the image
  EXPECT_EQ(bytes.size(), view + 20);
  EXPECT_TRUE(link.Receive(R"({"taken": 1})"));
  EXPECT_FALSE(link.Next().has_value()) << "seen already";

  auto image = std::make_shared<ShownImage>(ShownImage{1, 0, 1, 3, 1, {1, 2, 3}});
  show.scene_.Take(std::shared_ptr<const ShownImage>(image));
  keyframe.id.seq = keyframe.corners.seq = 1;
  show.scene_.Take(keyframe);
  const std::vector<uint8_t> with_image = link.Next().value();
  EXPECT_EQ(JsonOf(with_image)["view"]["encoding"], 1);
  EXPECT_EQ(WordAt(with_image, with_image.size() - 8), 3U);
  EXPECT_EQ(with_image[with_image.size() - 2], 3);
}

TEST(PageLink, HearsTheControls) {
  TestShow show;
  PageLink link(show);
  EXPECT_TRUE(link.Receive(R"({"seek": 4.5})"));
  EXPECT_TRUE(link.Receive(R"({"play": false})"));
  EXPECT_TRUE(link.Receive(R"({"speed": 20})"));
  EXPECT_EQ(show.clock_.now_s, 4.5);
  EXPECT_FALSE(show.clock_.playing);
  EXPECT_EQ(show.clock_.speed, 20);
}

TEST(PageLink, ControlsReachEveryPage) {
  TestShow show;
  PageLink one(show);
  PageLink other(show);
  TakeAll(one);
  TakeAll(other);
  EXPECT_TRUE(one.Receive(R"({"play": false})"));
  const std::vector<json> updates = TakeAll(other);
  ASSERT_EQ(updates.size(), 1U);
  EXPECT_EQ(updates[0]["playing"], false);
}

TEST(PageLink, NoPageOfOursSaysThis) {
  TestShow show;
  PageLink link(show);
  for (const char* text :
       {"", "[]", "{}", "null", "{", R"({"seek": "1"})", R"({"seek": 1e999})", R"({"speed": 0})",
        R"({"speed": -1})", R"({"speed": 1e9})", R"({"play": 1})", R"({"taken": -1})",
        R"({"watch": -1})", R"({"watch": 1e9})", R"({"seek": 1, "play": true})",
        R"({"shutdown": true})"}) {
    EXPECT_FALSE(link.Receive(text)) << text;
  }
  EXPECT_FALSE(link.Receive(std::string(PageLink::kMaxText + 1, ' ')));
  EXPECT_EQ(show.clock_.now_s, 0);
}

}  // namespace
}  // namespace pangea::viewer
