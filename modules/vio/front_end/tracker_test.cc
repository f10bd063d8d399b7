#include "vio/front_end/tracker.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <vector>

#include "core/rigid3.h"
#include "vio/front_end/test_images.h"

namespace pangea::vio {
namespace {

std::map<int32_t, Observation> ById(const TrackedFrame& frame) {
  std::map<int32_t, Observation> by_id;
  for (const Observation& observation : frame.observations) {
    by_id[observation.landmark_id] = observation;
  }
  return by_id;
}

struct Outcome {
  int tracked = 0;
  double rms_px = 0;
  double worst_px = 0;
};

// Tracks features of `image` in its rotated view, and compares the results with the true rotation.
Outcome TrackOnce(const cv::Mat& image, const cv::Mat& rotated, const Eigen::Quaterniond& truth,
                  const Eigen::Quaterniond& guess) {
  const CameraModel camera = PlainCamera();
  Tracker tracker(camera, {});
  const auto before = ById(tracker.Track(0, image, Eigen::Quaterniond::Identity()));
  const auto after = ById(tracker.Track(50'000, rotated, guess));
  Outcome outcome;
  for (const auto& [id, observation] : after) {
    const auto found = before.find(id);
    if (found == before.end()) {
      continue;
    }
    const Eigen::Vector2d expected = *camera.Project(truth * found->second.ray.homogeneous());
    const double error = (observation.pixel.cast<double>() - expected).norm();
    outcome.rms_px += error * error;
    outcome.worst_px = std::max(outcome.worst_px, error);
    ++outcome.tracked;
  }
  outcome.rms_px = std::sqrt(outcome.rms_px / std::max(1, outcome.tracked));
  return outcome;
}

TEST(Tracker, SpreadsFeaturesWithUniqueIds) {
  Tracker tracker(PlainCamera(), {});
  const cv::Mat image = RandomTexture(752, 480, 1);
  const TrackedFrame frame = tracker.Track(0, image, Eigen::Quaterniond::Identity());
  EXPECT_GE(frame.observations.size(), 120u);
  EXPECT_LE(frame.observations.size(), 150u);
  std::set<int32_t> ids;
  std::set<std::pair<int, int>> cells;
  for (const Observation& observation : frame.observations) {
    ids.insert(observation.landmark_id);
    cells.insert({static_cast<int>(observation.pixel.x() / 94),
                  static_cast<int>(observation.pixel.y() / 80)});
  }
  EXPECT_EQ(ids.size(), frame.observations.size());
  EXPECT_GE(cells.size(), 44u) << "of 48 parts of the image";
}

TEST(Tracker, TracksASmallRotationToSubpixel) {
  const cv::Mat image = RandomTexture(752, 480, 2);
  const Eigen::Quaterniond q = ExpSo3({0.004, -0.006, 0.01});
  const Outcome outcome =
      TrackOnce(image, RotatedView(image, PlainCamera(), q), q, Eigen::Quaterniond::Identity());
  EXPECT_GE(outcome.tracked, 110);
  EXPECT_LT(outcome.rms_px, 0.1);
}

TEST(Tracker, TheGyroCarriesItOverAFastRotation) {
  const cv::Mat image = RandomTexture(752, 480, 3);
  // 9 degrees between two images, about a third of it roll: 180 degrees a second at 20 Hz.
  const Eigen::Quaterniond q = ExpSo3({0.03, 0.14, 0.06});
  const cv::Mat rotated = RotatedView(image, PlainCamera(), q);
  // The gyro's own error: a bias of 0.08 rad/s.
  const Eigen::Quaterniond guess = ExpSo3({0, 0.004, 0}) * q;
  const Outcome outcome = TrackOnce(image, rotated, q, guess);
  EXPECT_GE(outcome.tracked, 70) << "a fifth of the image has left the view";
  EXPECT_LT(outcome.rms_px, 0.5);  // the patches themselves are rotated and foreshortened
}

TEST(Tracker, SurvivesAChangeOfExposure) {
  const cv::Mat image = RandomTexture(752, 480, 4);
  const Eigen::Quaterniond q = ExpSo3({0.004, -0.006, 0.0});
  cv::Mat darker;
  RotatedView(image, PlainCamera(), q).convertTo(darker, CV_8U, 0.7, -10);
  const Outcome outcome = TrackOnce(image, darker, q, q);
  EXPECT_GE(outcome.tracked, 100);
  EXPECT_LT(outcome.rms_px, 0.25);
}

// Errors accumulated from image to image would reach several tenths of a pixel on this ride.
TEST(Tracker, DoesNotDriftAlongATrack) {
  const cv::Mat image = RandomTexture(752, 480, 9);
  Tracker tracker(PlainCamera(), {});
  const auto first = ById(tracker.Track(0, image, Eigen::Quaterniond::Identity()));
  Eigen::Quaterniond q_now_first = Eigen::Quaterniond::Identity();
  std::map<int32_t, Observation> last;
  for (int i = 1; i <= 60; ++i) {
    // Slow rotations to and fro, with roll: the patches rotate by up to 8 degrees.
    const double phase = 0.2 * i;
    const Eigen::Quaterniond q =
        ExpSo3({0.006 * std::sin(phase), 0.008 * std::sin(0.7 * phase), 0.015 * std::cos(phase)});
    q_now_first = q * q_now_first;
    cv::Mat view = RotatedView(image, PlainCamera(), q_now_first);
    cv::Mat noise(view.size(), CV_16S);
    cv::theRNG().state = static_cast<uint64_t>(i);
    cv::randn(noise, 0, 3);
    cv::add(view, noise, view, cv::noArray(), CV_8U);
    last = ById(tracker.Track(50'000 * i, view, q));
  }
  std::vector<double> errors;
  for (const auto& [id, observation] : last) {
    if (const auto found = first.find(id); found != first.end()) {
      const Eigen::Vector2d expected =
          *PlainCamera().Project(q_now_first * found->second.ray.homogeneous());
      errors.push_back((observation.pixel.cast<double>() - expected).norm());
    }
  }
  ASSERT_GE(errors.size(), 60u);
  std::nth_element(errors.begin(), errors.begin() + errors.size() / 2, errors.end());
  EXPECT_LT(errors[errors.size() / 2], 0.1);
}

// A wrong first search costs only time: the second search corrects it.
TEST(Tracker, AnEvenMotionIsFoundWhereItLeads) {
  const cv::Mat image = RandomTexture(752, 480, 10);
  Tracker tracker(PlainCamera(), {});
  for (int i = 0; i < 3; ++i) {
    // About 6 px per image, which the gyro does not measure.
    const Eigen::Quaterniond q_now_first = ExpSo3(i * Eigen::Vector3d(0.008, 0.012, 0));
    tracker.Track(50'000 * i, RotatedView(image, PlainCamera(), q_now_first),
                  Eigen::Quaterniond::Identity());
  }
  EXPECT_GE(tracker.statistics().as_predicted, 100);
  EXPECT_GE(tracker.statistics().as_predicted, 0.95 * tracker.statistics().tracked);
}

TEST(Tracker, RejectsAnUnrelatedImage) {
  const Outcome outcome = TrackOnce(RandomTexture(752, 480, 5), RandomTexture(752, 480, 6),
                                    Eigen::Quaterniond::Identity(), Eigen::Quaterniond::Identity());
  EXPECT_LE(outcome.tracked, 5);
}

TEST(Tracker, ABlankImageHasNoFeaturesAndIdsGoOn) {
  Tracker tracker(PlainCamera(), {});
  const cv::Mat image = RandomTexture(752, 480, 7);
  const cv::Mat blank(480, 752, CV_8U, cv::Scalar(90));
  const auto first = ById(tracker.Track(0, image, Eigen::Quaterniond::Identity()));
  EXPECT_TRUE(tracker.Track(1, blank, Eigen::Quaterniond::Identity()).observations.empty());
  const auto again = ById(tracker.Track(2, image, Eigen::Quaterniond::Identity()));
  ASSERT_FALSE(again.empty());
  EXPECT_GT(again.begin()->first, first.rbegin()->first);
  tracker.Reset();
  EXPECT_EQ(ById(tracker.Track(3, image, Eigen::Quaterniond::Identity())).begin()->first, 0);
}

TEST(Tracker, IsDeterministic) {
  const cv::Mat image = RandomTexture(752, 480, 8);
  const Eigen::Quaterniond q = ExpSo3({0.01, 0.02, 0.0});
  const cv::Mat rotated = RotatedView(image, PlainCamera(), q);
  Tracker one(PlainCamera(), {}), two(PlainCamera(), {});
  one.Track(0, image, q);
  two.Track(0, image, q);
  const auto a = one.Track(1, rotated, q).observations;
  const auto b = two.Track(1, rotated, q).observations;
  ASSERT_EQ(a.size(), b.size());
  for (size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a[i].landmark_id, b[i].landmark_id);
    EXPECT_EQ(a[i].pixel, b[i].pixel);
  }
}

}  // namespace
}  // namespace pangea::vio
