#include "vio/front_end/describer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <opencv2/imgproc.hpp>

#include "core/matching.h"
#include "core/rigid3.h"
#include "vio/front_end/test_images.h"
#include "vio/front_end/tracker.h"

namespace pangea::vio {
namespace {

const Eigen::Vector3d kUpright = Eigen::Vector3d::UnitY();  // gravity in the camera frame

TrackedFrame Tracks(const cv::Mat& image) {
  Tracker tracker(PlainCamera(), {});
  return tracker.Track(0, image, Eigen::Quaterniond::Identity());
}

TEST(Describer, PutsEveryLandmarkFirstWithItsPixel) {
  const cv::Mat image = RandomTexture(752, 480, 1);
  const TrackedFrame frame = Tracks(image);
  Describer describer(PlainCamera(), {});
  const std::vector<Corner> corners = describer.Describe(image, frame, kUpright);
  EXPECT_LE(corners.size(), 700u);
  EXPECT_GE(corners.size(), 500u);
  size_t landmarks = 0;
  size_t observation = 0;
  for (const Corner& corner : corners) {
    if (corner.landmark_id == kNoLandmark) {
      break;
    }
    while (frame.observations[observation].landmark_id != corner.landmark_id) {
      ++observation;
      ASSERT_LT(observation, frame.observations.size());
    }
    EXPECT_EQ(corner.pixel, frame.observations[observation].pixel);
    ++landmarks;
  }
  // All landmarks except those at the image's rim, where no descriptor fits.
  EXPECT_GE(landmarks, frame.observations.size() * 8 / 10);
  for (size_t i = landmarks; i < corners.size(); ++i) {
    EXPECT_EQ(corners[i].landmark_id, kNoLandmark);
  }
}

// A link that carries only some of the corners takes the first.
TEST(Describer, BlobsAndCornersTakeTurns) {
  DescriberOptions options;
  options.max_blobs = 0;
  const cv::Mat image = RandomTexture(752, 480, 2);
  const std::vector<Corner> only_corners =
      Describer(PlainCamera(), options).Describe(image, {}, kUpright);
  options.max_blobs = 100;
  const std::vector<Corner> both = Describer(PlainCamera(), options).Describe(image, {}, kUpright);
  EXPECT_EQ(both.size(), only_corners.size());
  int blobs = 0;
  for (int i = 0; i < 100; ++i) {
    blobs += std::ranges::none_of(
        only_corners, [&](const Corner& corner) { return corner.pixel == both[i].pixel; });
  }
  EXPECT_NEAR(blobs, 50, 10);
}

TEST(Describer, CoversTheImageAndSeveralOctaves) {
  Describer describer(PlainCamera(), {});
  const std::vector<Corner> corners = describer.Describe(RandomTexture(752, 480, 2), {}, kUpright);
  std::vector<int> part(4, 0);
  std::map<int, int> octave;
  for (const Corner& corner : corners) {
    ++part[(corner.pixel.x() > 376 ? 1 : 0) + (corner.pixel.y() > 240 ? 2 : 0)];
    ++octave[corner.octave];
  }
  for (const int count : part) {
    EXPECT_GT(count, 80);
  }
  EXPECT_GT(octave[0], 50);
  EXPECT_GT(octave[3], 20);
}

// Matches two views by mutual nearest neighbours; returns the share within 3 px of the truth.
double CorrectShare(const cv::Mat& a, const cv::Mat& b, const Eigen::Quaterniond& q_b_a,
                    DescriptorKind kind, int* matches) {
  Describer describer(PlainCamera(), {.descriptor = kind});
  const std::vector<Corner> corners_a = describer.Describe(a, Tracks(a), kUpright);
  const std::vector<Corner> corners_b = describer.Describe(b, Tracks(b), q_b_a * kUpright);
  int correct = 0;
  const auto found = MatchCorners(corners_a, corners_b, {.max_distance = LimitsOf(kind).alike});
  for (const CornerMatch& match : found) {
    const CameraModel camera = PlainCamera();
    const auto ray = camera.Unproject(corners_a[match.a].pixel.cast<double>());
    const auto expected = camera.Project(q_b_a * ray->homogeneous());
    if (expected && (*expected - corners_b[match.b].pixel.cast<double>()).norm() < 3.0) {
      ++correct;
    }
  }
  *matches = static_cast<int>(found.size());
  return static_cast<double>(correct) / std::max<size_t>(1, found.size());
}

TEST(Describer, DescriptorsSurviveARollOfThirtyDegrees) {
  const cv::Mat image = RandomTexture(752, 480, 3);
  const Eigen::Quaterniond roll = ExpSo3({0, 0, 0.52});
  const cv::Mat rotated = RotatedView(image, PlainCamera(), roll);
  for (const auto kind : {DescriptorKind::kOrb, DescriptorKind::kPatchNetwork}) {
    int matches = 0;
    EXPECT_GT(CorrectShare(image, rotated, roll, kind, &matches), 0.9);
    EXPECT_GT(matches, 120);
  }
}

TEST(Describer, DescriptorsSurviveScaleAndExposure) {
  const cv::Mat image = RandomTexture(752, 480, 4);
  // The same view through a lens of 1.25 times the focal length is a zoom about the centre.
  CameraModel near = PlainCamera();
  near.fx = near.fy = 460 * 1.25;
  cv::Mat zoomed(480, 752, CV_8U), map_x(480, 752, CV_32F), map_y(480, 752, CV_32F);
  for (int y = 0; y < 480; ++y) {
    for (int x = 0; x < 752; ++x) {
      map_x.at<float>(y, x) = static_cast<float>((x - near.cx) / 1.25 + near.cx);
      map_y.at<float>(y, x) = static_cast<float>((y - near.cy) / 1.25 + near.cy);
    }
  }
  cv::remap(image, zoomed, map_x, map_y, cv::INTER_CUBIC);
  zoomed.convertTo(zoomed, CV_8U, 0.8, -5);
  Describer describer(PlainCamera(), {});
  const auto far_corners = describer.Describe(image, Tracks(image), kUpright);
  const auto near_corners = describer.Describe(zoomed, Tracks(zoomed), kUpright);
  int correct = 0;
  const auto found = MatchCorners(far_corners, near_corners, {});
  for (const CornerMatch& match : found) {
    const Eigen::Vector2d centre(near.cx, near.cy);
    const Eigen::Vector2d expected =
        centre + 1.25 * (far_corners[match.a].pixel.cast<double>() - centre);
    correct += (expected - near_corners[match.b].pixel.cast<double>()).norm() < 3.0 ? 1 : 0;
  }
  EXPECT_GT(found.size(), 80u);
  EXPECT_GT(correct, static_cast<int>(0.85 * static_cast<double>(found.size())));
}

TEST(Describer, ABlankImageHasNoCorners) {
  Describer describer(PlainCamera(), {});
  EXPECT_TRUE(describer.Describe(cv::Mat(480, 752, CV_8U, cv::Scalar(80)), {}, kUpright).empty());
}

}  // namespace
}  // namespace pangea::vio
