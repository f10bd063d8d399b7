#include "vio/front_end/repeated_images.h"

#include <Eigen/LU>
#include <algorithm>
#include <cstring>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "core/median.h"

namespace pangea::vio {
namespace {

constexpr size_t kPoints = 60;     // features that are compared
constexpr size_t kMinPoints = 10;  // with fewer, only equal pixels tell
constexpr int kHalf_px = 5;        // of the patch around a feature
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
constexpr double kLongestStill_s = 0.1;

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
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  for (int y = at.y - kHalf_px; y <= at.y + kHalf_px; ++y) {
    const uchar* row = before.ptr<uchar>(y);
    const uchar* above = before.ptr<uchar>(y - 1);
    const uchar* below = before.ptr<uchar>(y + 1);
    const uchar* now = after.ptr<uchar>(y);
    for (int x = at.x - kHalf_px; x <= at.x + kHalf_px; ++x) {
      const Eigen::Vector3d slope(0.5 * (row[x + 1] - row[x - 1]), 0.5 * (below[x] - above[x]), 1);
      normal += slope * slope.transpose();
      right += slope * (row[x] - now[x]);
    }
  }
  const Eigen::FullPivLU<Eigen::Matrix3d> solver(normal);
  if (!solver.isInvertible()) {
    return std::nullopt;
  }
  return solver.solve(right).head<2>().norm();
}

}  // namespace

void RepeatedImages::NoteNew(const cv::Mat& image, const TrackedFrame& frame) {
  std::map<int32_t, Eigen::Vector2f> before;
  for (const Observation& one : frame_.observations) {
    before[one.landmark_id] = one.pixel;
  }
  std::vector<double> shifts;
  for (const Observation& one : frame.observations) {
    if (const auto last = before.find(one.landmark_id); last != before.end()) {
      shifts.push_back((one.pixel - last->second).norm());
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
  for (const Observation& one : frame_.observations) {
    if (const auto pixel = camera_.Project(q_cam_lastcam * one.ray.homogeneous())) {
      shifts.push_back((*pixel - one.pixel.cast<double>()).norm());
    }
  }
  const double rotated =
      shifts.empty() ? 0 : Median(std::move(shifts)) - max_rotation_error / camera_.PixelAngle();
  return std::max(rotated, age_s < kSameSpeed_s ? speed_px_s_ * age_s : 0);
}

bool RepeatedImages::HasMovedLessThan(double shift_px, const cv::Mat& image) const {
  std::vector<double> shifts;
  const size_t step = std::max<size_t>(1, frame_.observations.size() / kPoints);
  for (size_t i = 0; i < frame_.observations.size(); i += step) {
    const Eigen::Vector2f& pixel = frame_.observations[i].pixel;
    const cv::Point at(cvRound(pixel.x()), cvRound(pixel.y()));
    const auto shift = HasPatch(image, at) ? Shift_px(image_, image, at) : std::nullopt;
    if (shift) {
      shifts.push_back(*shift);
    }
  }
  const auto small =
      std::count_if(shifts.begin(), shifts.end(), [&](double one) { return one < shift_px; });
  return shifts.size() >= kMinPoints &&
         static_cast<double>(small) >= kShare * static_cast<double>(shifts.size());
}

bool RepeatedImages::IsRepeat(int64_t utime, const cv::Mat& image,
                              const Eigen::Quaterniond& q_cam_lastcam,
                              double max_rotation_error) const {
  if (image_.empty() || image.size() != image_.size()) {
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
