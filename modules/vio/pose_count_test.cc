// Tests what is said of an odometry that gives few poses.

#include "vio/pose_count.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace pangea::vio {
namespace {

using ::testing::HasSubstr;

constexpr int64_t kStep_us = 100'000;

class PoseCountTest : public ::testing::Test {
 protected:
  void AddPoses(int images, const std::string& suspect = "") {
    for (int i = 0; i < images; ++i) {
      count_.AddPose(utime_ += kStep_us, suspect);
    }
  }
  void AddNone(int images, const std::string& reason, const std::string& suspect = "") {
    for (int i = 0; i < images; ++i) {
      count_.AddNone(utime_ += kStep_us, reason, suspect);
    }
  }

  PoseCount count_;
  int64_t utime_ = 1'700'000'000'000'000;
};

TEST_F(PoseCountTest, HalfOfTheImagesAreEnough) {
  EXPECT_FALSE(count_.WhyFew());
  AddNone(30, "collecting images");
  AddPoses(100);
  AddNone(99, "lost");
  EXPECT_FALSE(count_.WhyFew());
  AddNone(10, "lost");
  EXPECT_TRUE(count_.WhyFew());
}

// Of 4 s of images a start may take three.
TEST_F(PoseCountTest, TheTimeOfAStartDoesNotCount) {
  AddNone(30, "collecting images");
  AddPoses(8);
  AddNone(6, "lost");
  EXPECT_FALSE(count_.WhyFew());
}

TEST_F(PoseCountTest, ReasonsAreCountedWhateverTheirNumbers) {
  AddPoses(2);
  AddNone(1, "the start does not explain the images: 12 % inliers");
  AddNone(50, "not enough motion yet");
  AddNone(59, "the start does not explain the images: 7 % inliers");
  const std::string why = *count_.WhyFew();
  EXPECT_THAT(why, HasSubstr("few poses: 2 of 112 images have one. Likely causes: "));
  EXPECT_THAT(why, HasSubstr("none: 60 times: the start does not explain the images: 7 % inliers; "
                             "50 times: not enough motion yet"));
}

TEST_F(PoseCountTest, TheSuspectIsNamed) {
  AddNone(40, "no fit", "the sign is wrong");
  AddNone(1, "no fit");
  EXPECT_EQ(*count_.WhyFew(),
            "no pose: the odometry did not start in 41 images; at the last: no fit. Probably the "
            "sign is wrong");
  AddPoses(1);
  EXPECT_THAT(*count_.WhyFew(), HasSubstr("have one. Probably the sign is wrong. Why"));
}

// A false start may last long.
TEST_F(PoseCountTest, ASuspectCountsUntilMostImagesHaveAPoseAgain) {
  AddPoses(500);
  AddNone(50, "no fit", "the sign is wrong");
  EXPECT_THAT(*count_.WhyFew(), HasSubstr("few poses: 500 of 550 images have one. Probably the"));
  AddPoses(50);
  EXPECT_FALSE(count_.WhyFew());
}

TEST_F(PoseCountTest, SuspectPosesAreDoubtful) {
  AddPoses(500);
  AddPoses(10, "the focal length is wrong");
  EXPECT_EQ(
      *count_.WhyFew(),
      "the poses are doubtful (510 of 510 images have one). Probably the focal length is wrong");
  AddPoses(1);
  EXPECT_FALSE(count_.WhyFew()) << "of another map, in which it is right";
}

}  // namespace
}  // namespace pangea::vio
