#include "vio/front_end/repeated_images.h"

#include <Eigen/LU>
#include <algorithm>
#include <cstring>
#include <optional>
#include <utility>
#include <vector>

#include "core/median.h"

namespace pangea::vio {
namespace {

constexpr size_t kPoints = 60;     // features that are compared
constexpr size_t kMinPoints = 10;  // a blank view, as of a covered lens, may be equal to the next
constexpr double kMinDeterminant = 1;
constexpr int kHalf_px = 5;  // of the patch around a feature
// Copies that were compressed anew differ by 0.02 px at this share of the features, new images of
// a stationary body by 0.1 px, for the noise of the sensor is new.
constexpr double kShare = 0.8;
constexpr double kMaxShift_px = 0.15;
constexpr double kShareOfExpected = 0.25;
// A smaller expected shift does no harm if it is not measured.
constexpr double kMinExpected_px = 0.35;
// The features keep their speed for so long, unless the body stops at once.
constexpr double kSameSpeed_s = 0.07;
// After this time an image counts as new if its pixels have changed: everything in view moves with
// the camera. If they have not, but none is expected to: a still scene without noise.
constexpr double kLongest_s = 0.5;
constexpr double kLongestStill_s = 0.08;

double Seconds(int64_t us) { return 1e-6 * static_cast<double>(us); }

bool Equal(const cv::Mat& a, const cv::Mat& b) {
  if (a.size() != b.size() || a.type() != b.type()) {
    return false;
  }
  for (int row = 0; row < a.rows; ++row) {
    if (std::memcmp(a.ptr(row), b.ptr(row), a.cols * a.elemSize()) != 0) {
      return false;
    }
  }
  return true;
}

bool HasPatch(const cv::Mat& image, const cv::Point& at) {
  constexpr int kRim_px = kHalf_px + 1;  // for the gradient
  return at.x >= kRim_px && at.y >= kRim_px && at.x < image.cols - kRim_px &&
         at.y < image.rows - kRim_px;
}

// How far the patch around `at` has moved: one step of Lucas & Kanade, apart from a change of
// brightness. It is only exact for shifts below a pixel, which is what must be told from none.
std::optional<double> Shift_px(const cv::Mat& before, const cv::Mat& after, const cv::Point& at) {
  // Sums over the patch, in integers: of the slopes (twice the gradient), of the difference, and of
  // their products.
  int sx = 0, sy = 0, sd = 0, xx = 0, xy = 0, yy = 0, xd = 0, yd = 0;
  for (int y = at.y - kHalf_px; y <= at.y + kHalf_px; ++y) {
    const uchar* row = before.ptr<uchar>(y);
    const uchar* above = before.ptr<uchar>(y - 1);
    const uchar* below = before.ptr<uchar>(y + 1);
    const uchar* now = after.ptr<uchar>(y);
    for (int x = at.x - kHalf_px; x <= at.x + kHalf_px; ++x) {
      const int slope_x = row[x + 1] - row[x - 1], slope_y = below[x] - above[x];
      const int difference = row[x] - now[x];
      sx += slope_x;
      sy += slope_y;
      sd += difference;
      xx += slope_x * slope_x;
      xy += slope_x * slope_y;
      yy += slope_y * slope_y;
      xd += slope_x * difference;
      yd += slope_y * difference;
    }
  }
  constexpr double kPixels = (2 * kHalf_px + 1) * (2 * kHalf_px + 1);
  const auto central = [](int product, int a, int b) {
    return product - static_cast<double>(a) * b / kPixels;
  };
  Eigen::Matrix2d normal;
  normal << central(xx, sx, sx), central(xy, sx, sy), central(xy, sx, sy), central(yy, sy, sy);
  if (normal.determinant() < kMinDeterminant) {
    return std::nullopt;
  }
  const Eigen::Vector2d right(central(xd, sx, sd), central(yd, sy, sd));
  return 2 * (normal.inverse() * right).norm();
}

}  // namespace

void RepeatedImages::NoteNew(const cv::Mat& image, const TrackedFrame& frame) {
  std::vector<double> shifts;
  auto last = frame_.observations.begin();  // both in the order of their ids
  for (const Observation& one : frame.observations) {
    while (last != frame_.observations.end() && last->landmark_id < one.landmark_id) {
      ++last;
    }
    if (last != frame_.observations.end() && last->landmark_id == one.landmark_id) {
      shifts.push_back((one.pixel - last->pixel).norm());
    }
  }
  speed_px_s_ = shifts.size() < kMinPoints
                    ? 0
                    : Median(std::move(shifts)) / Seconds(frame.utime - frame_.utime);
  image_ = image.clone();
  frame_ = frame;
}

// By the camera's rotation, or by the features' motion up to the last image.
double RepeatedImages::ExpectedShift_px(const Eigen::Quaterniond& q_cam_lastcam,
                                        double max_rotation_error, double age_s) const {
  std::vector<double> shifts;
  for (size_t i = 0; i < frame_.observations.size(); i += PointStep()) {
    const Observation& one = frame_.observations[i];
    if (const auto pixel = camera_.Project(q_cam_lastcam * one.ray.homogeneous())) {
      shifts.push_back((*pixel - one.pixel.cast<double>()).norm());
    }
  }
  const double rotated =
      shifts.empty() ? 0 : Median(std::move(shifts)) - max_rotation_error / camera_.PixelAngle();
  return std::max(rotated, age_s < kSameSpeed_s ? speed_px_s_ * age_s : 0);
}

// Of all features, a sample of kPoints or some more.
size_t RepeatedImages::PointStep() const {
  return std::max<size_t>(1, frame_.observations.size() / kPoints);
}

// A moving image is found by its first few features.
bool RepeatedImages::HasMovedLessThan(double shift_px, const cv::Mat& image) const {
  const size_t count = (frame_.observations.size() + PointStep() - 1) / PointStep();
  const double most_moved = (1 - kShare) * static_cast<double>(count);
  size_t still = 0, moved = 0;
  for (size_t i = 0; i < frame_.observations.size(); i += PointStep()) {
    const Eigen::Vector2f& pixel = frame_.observations[i].pixel;
    const cv::Point at(cvRound(pixel.x()), cvRound(pixel.y()));
    const auto shift = HasPatch(image, at) ? Shift_px(image_, image, at) : std::nullopt;
    if (shift) {
      ++(*shift < shift_px ? still : moved);
    }
    if (static_cast<double>(moved) > most_moved) {
      return false;
    }
  }
  return still >= kMinPoints;
}

bool RepeatedImages::IsRepeat(int64_t utime, const cv::Mat& image,
                              const Eigen::Quaterniond& q_cam_lastcam,
                              double max_rotation_error) const {
  if (frame_.observations.size() < kMinPoints || image.size() != image_.size()) {
    return false;
  }
  const double age_s = Seconds(utime - frame_.utime);
  const double expected_px = ExpectedShift_px(q_cam_lastcam, max_rotation_error, age_s);
  const bool should_move = expected_px > kMinExpected_px;
  if (Equal(image, image_)) {
    return should_move || age_s < kLongestStill_s;
  }
  return should_move && age_s < kLongest_s &&
         HasMovedLessThan(std::min(kMaxShift_px, kShareOfExpected * expected_px), image);
}

}  // namespace pangea::vio
