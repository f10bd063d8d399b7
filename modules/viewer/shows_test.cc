// The two shows: a captured log, and a bus.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "log_file/log_reader.h"
#include "log_file/log_writer.h"
#include "messages/channels.h"
#include "messages/encoding.h"
#include "messages/messages.h"
#include "pangea/again_t.hpp"
#include "pangea/have_t.hpp"
#include "pangea/image_t.hpp"
#include "pangea/pose_t.hpp"
#include "pangea/resend_request_t.hpp"
#include "viewer/log_show.h"
#include "viewer/viewer_process.h"
#include "viewer/viewer_test_world.h"

namespace pangea::viewer {
namespace {

using testing::SizeIs;

const std::string kLog = std::string(PANGEA_SOURCE_DIR) + "/logs/two_walks/session.lcm";
class LogShowTest : public testing::Test {
 protected:
  LogShow show_{kLog};
};

TEST_F(LogShowTest, KnowsTheWholeLogFromTheStart) {
  EXPECT_EQ(show_.num_refused(), 0);
  EXPECT_FALSE(show_.clock().live);
  EXPECT_NEAR(show_.clock().end_s, 13.95, 0.1);
  ASSERT_THAT(show_.all_fusions(), SizeIs(1));
  EXPECT_TRUE(show_.all_fusions()[0].fused);
  EXPECT_EQ(show_.clock().now_s, 0);
  EXPECT_TRUE(show_.scene().keyframes().empty());
}

TEST_F(LogShowTest, PlaysAtItsSpeedAndStopsAtTheEnd) {
  show_.SetSpeed(2);
  show_.Advance(1.5);
  EXPECT_NEAR(show_.clock().now_s, 3, 1e-9);
  EXPECT_FALSE(show_.scene().keyframes().empty());
  EXPECT_LT(show_.scene().keyframes().size(), 30U);
  show_.Play(false);
  show_.Advance(1);
  EXPECT_NEAR(show_.clock().now_s, 3, 1e-9);
  show_.Play(true);
  show_.Advance(100);
  EXPECT_EQ(show_.clock().now_s, show_.clock().end_s);
  EXPECT_FALSE(show_.clock().playing);
  EXPECT_THAT(show_.scene().keyframes(), SizeIs(63));
  EXPECT_THAT(show_.scene().constraints(), SizeIs(65));
  EXPECT_THAT(show_.scene().agents(), SizeIs(2));
  show_.Play(true);
  EXPECT_EQ(show_.clock().now_s, 0);
}

// Whichever way a time is reached, the same is seen there.
TEST_F(LogShowTest, SeekingBackShowsWhatPlayingShowed) {
  show_.Advance(6);
  const size_t keyframes = show_.scene().keyframes().size();
  const size_t constraints = show_.scene().constraints().size();
  const int64_t epoch = show_.epoch();
  show_.Seek(9);
  EXPECT_EQ(show_.epoch(), epoch) << "forward, pages keep what they have";
  EXPECT_GT(show_.scene().keyframes().size(), keyframes);
  show_.Seek(6);
  EXPECT_NE(show_.epoch(), epoch);
  EXPECT_EQ(show_.scene().keyframes().size(), keyframes);
  EXPECT_EQ(show_.scene().constraints().size(), constraints);
  show_.Seek(-5);
  EXPECT_EQ(show_.clock().now_s, 0);
  show_.Seek(1e9);
  EXPECT_EQ(show_.clock().now_s, show_.clock().end_s);
}

// A log of many solves: fewer are kept, the last is, and what became one when.
TEST_F(LogShowTest, OfManySolvesTheLastAndTheFusionsAreKept) {
  LogShow thinned(kLog, 500);
  EXPECT_LT(thinned.NumSolvedPoses(), 500U);
  EXPECT_GT(show_.NumSolvedPoses(), 1000U);
  EXPECT_THAT(thinned.all_fusions(), SizeIs(1));
  show_.Seek(1e9);
  thinned.Seek(1e9);
  EXPECT_THAT(thinned.scene().fusions(), SizeIs(1));
  const auto& whole = show_.scene().keyframes();
  ASSERT_EQ(thinned.scene().keyframes().size(), whole.size());
  for (const SceneKeyframe& keyframe : thinned.scene().keyframes()) {
    const auto same = std::ranges::find(whole, keyframe.shown.id,
                                        [](const SceneKeyframe& other) { return other.shown.id; });
    ASSERT_TRUE(keyframe.T_map_body);
    EXPECT_LT((keyframe.T_map_body->t - same->T_map_body->t).norm(), 1e-3);
  }
}

// Only the images of keyframes are kept; all images of a log would fill the memory.
TEST(LogShow, KeepsTheImagesOfKeyframes) {
  const std::string path = testing::TempDir() + "viewer_images.lcm";
  KeyframeMessage keyframe{};
  ReadLog(kLog, [&keyframe](const LogEvent& event) {
    if (event.channel == "KEYFRAME_1" && keyframe.utime == 0) {
      EXPECT_TRUE(DecodeMessage(event.data, &keyframe));
    }
  });
  {
    LogFileWriter log(path);
    const auto write_image = [&log](int64_t log_utime, int64_t utime) {
      image_t image{};
      image.utime = utime;
      image.encoding = image_t::ENCODING_RAW8;
      image.width = image.height = 1;
      image.num_chunks = 1;
      image.total_bytes = image.num_bytes = 1;
      image.data = {7};
      log.Write(log_utime, "IMAGE_1", EncodeMessage(image));
    };
    log.Write(kStart, "POSE_1", EncodeMessage(pose_t{}));
    write_image(kStart + 1'000'000, keyframe.utime - 500'000);
    write_image(kStart + 2'000'000, keyframe.utime + 10'000);
    log.Write(kStart + 3'000'000, "KEYFRAME_1", EncodeMessage(keyframe));
  }
  LogShow show(path);
  show.Seek(1.5);
  EXPECT_TRUE(show.scene().agents().empty());
  show.Seek(3);
  const auto image = show.scene().agents().at(1).camera.image();
  ASSERT_TRUE(image);
  EXPECT_EQ(image->utime, keyframe.utime + 10'000);
}

std::string WhyNot(const std::string& path) {
  try {
    LogShow show(path);
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "";
}

TEST(LogShow, SaysWhatIsWrongWithAFile) {
  EXPECT_THAT(WhyNot("no/such.lcm"), testing::HasSubstr("there is no such log"));
  EXPECT_THAT(WhyNot(std::string(PANGEA_SOURCE_DIR) + "/README.md"),
              testing::HasSubstr("README.md: is no LCM log"));
  const std::string path = testing::TempDir() + "other.lcm";
  LogFileWriter(path).Write(1, "OTHER", {});
  EXPECT_THAT(WhyNot(path), testing::HasSubstr("other.lcm: holds nothing to show"));
}

TEST(LogShow, ShowsWhatIsLeftOfADamagedLogAndSaysSo) {
  const std::string path = testing::TempDir() + "damaged.lcm";
  std::filesystem::copy_file(kLog, path, std::filesystem::copy_options::overwrite_existing);
  std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
  file.seekp(996321).put(0);  // a CONSTRAINT's first byte
  file.close();
  LogShow show(path);
  EXPECT_FALSE(show.readings().at(path).whole());
  EXPECT_EQ(show.source(), "damaged.lcm (damaged: not all of it can be read)");
  EXPECT_NEAR(show.clock().end_s, LogShow(kLog).clock().end_s, 0.1) << "not up to the damage";
}

class ViewerProcessTest : public testing::Test {
 protected:
  ViewerProcessTest() {
    bus_.Subscribe(std::string(channels::kResendRequest), [this](const std::string&, Bytes data) {
      asked_.emplace_back();
      EXPECT_TRUE(DecodeMessage(data, &asked_.back()));
    });
    bus_.Subscribe("STATUS_viewer", [this](const std::string&, Bytes data) {
      EXPECT_TRUE(DecodeMessage(data, &status_));
    });
  }

  void TickAt(double time_s) {
    process_.Tick(kStart + static_cast<int64_t>(1e6 * time_s));
    bus_.Drain();
  }

  LocalBus bus_;
  ViewerProcess process_{bus_, "memory", kStart};
  std::vector<resend_request_t> asked_;
  status_t status_{};
};

TEST_F(ViewerProcessTest, ShowsACapturedSession) {
  ReadLog(kLog, [this](const LogEvent& event) { bus_.Publish(event.channel, event.data); });
  bus_.Drain();
  TickAt(1);
  EXPECT_THAT(process_.scene().keyframes(), SizeIs(63));
  EXPECT_THAT(process_.scene().constraints(), SizeIs(65));
  EXPECT_THAT(process_.scene().fusions(), SizeIs(1));
  EXPECT_EQ(status_.num_refused, 0);
  EXPECT_GT(status_.messages_in, 300);
}

// A viewer that starts late asks for the keyframes before it, and takes the answers.
TEST_F(ViewerProcessTest, AsksForWhatCameBefore) {
  have_t have{};
  have.num_maps = 1;
  have.maps = {ToMessage(TestMap(1))};
  have.highest_seq = {120};
  PublishMessage(bus_, std::string(channels::kHave), have);
  bus_.Drain();
  for (const double time_s : {0.1, 1.2, 1.3}) {
    TickAt(time_s);
  }
  ASSERT_THAT(asked_, SizeIs(2));
  EXPECT_EQ(asked_[0].channel, "CONSTRAINT");
  EXPECT_EQ(asked_[1].channel, "KEYFRAME_1");
  EXPECT_EQ(asked_[1].requester, "viewer");
  EXPECT_EQ(asked_[1].from_seq, 0);

  again_t again{};
  ReadLog(kLog, [&again](const LogEvent& event) {
    if (event.channel == "KEYFRAME_1") {
      again.channel = event.channel;
      again.data.assign(event.data.begin(), event.data.end());
      again.num_bytes = static_cast<int32_t>(again.data.size());
    }
  });
  PublishMessage(bus_, "AGAIN_viewer", again);
  bus_.Drain();
  EXPECT_THAT(process_.scene().keyframes(), SizeIs(1));
}

// Malformed messages are counted, and nothing of them is shown.
TEST_F(ViewerProcessTest, RefusesNonsense) {
  const std::vector<uint8_t> noise(100, 0xff);
  for (const char* channel : {"KEYFRAME_1", "POSE_1", "CORRECTION_1", "CONSTRAINT", "MAP_STATE",
                              "STATUS_x", "HAVE", "AGAIN_viewer"}) {
    bus_.Publish(channel, noise);
  }
  pose_t pose{};
  pose.state = 9;
  PublishMessage(bus_, "POSE_1", pose);
  pose.state = pose_t::STATE_TRACKING;
  PublishMessage(bus_, "POSE_1", pose);
  again_t again{};
  again.channel = "AGAIN_viewer";
  PublishMessage(bus_, "AGAIN_viewer", again);
  bus_.Drain();
  TickAt(1);
  int64_t refused = 0;
  for (const counter_t& counter : status_.refused) {
    refused += counter.count;
  }
  EXPECT_EQ(refused, 11);
  EXPECT_TRUE(process_.scene().agents().empty());
  EXPECT_TRUE(process_.scene().keyframes().empty());
}

}  // namespace
}  // namespace pangea::viewer
