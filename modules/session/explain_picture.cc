#include <fmt/format.h>

#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <stdexcept>

#include "common/euroc.h"
#include "session/explain.h"

namespace pangea::session {
namespace {

// Okabe and Ito's, told apart with any colour vision (BGR).
const cv::Scalar kGood(115, 158, 0), kBad(0, 94, 213), kNeutral(233, 180, 86), kText(255, 255, 255);
constexpr int kCaption_px = 34;

// The image nearest to the keyframe in time, in colour; dark without one.
cv::Mat ImageOf(const Keyframe& keyframe, const std::map<int32_t, std::string>& recordings) {
  cv::Mat image(keyframe.camera.height, keyframe.camera.width, CV_8UC3, cv::Scalar(40, 40, 40));
  const auto folder = recordings.find(keyframe.id.map.agent_id);
  if (folder == recordings.end()) {
    return image;
  }
  const EurocRecording recording(folder->second);
  constexpr int64_t kMaxOff_us = 60'000;
  size_t nearest = 0;
  int64_t off = kMaxOff_us;
  for (size_t i = 0; i < recording.images().size(); ++i) {
    const int64_t this_off = std::abs(recording.images()[i].utime - keyframe.utime);
    if (this_off < off) {
      off = this_off;
      nearest = i;
    }
  }
  std::string why;
  const cv::Mat grey = off < kMaxOff_us ? recording.LoadImage(nearest, &why) : cv::Mat();
  if (!grey.empty() && grey.cols == image.cols && grey.rows == image.rows) {
    cv::cvtColor(grey, image, cv::COLOR_GRAY2BGR);
  }
  return image;
}

cv::Point ToPoint(const Eigen::Vector2d& pixel) {
  return {static_cast<int>(std::lround(pixel.x())), static_cast<int>(std::lround(pixel.y()))};
}

class Row {
 public:
  Row(const cv::Mat& left, const cv::Mat& right, const std::string& caption)
      : offset_(left.cols, kCaption_px),
        canvas_(std::max(left.rows, right.rows) + kCaption_px, left.cols + right.cols, CV_8UC3,
                cv::Scalar(0, 0, 0)) {
    left.copyTo(canvas_(cv::Rect(0, kCaption_px, left.cols, left.rows)));
    right.copyTo(canvas_(cv::Rect(left.cols, kCaption_px, right.cols, right.rows)));
    cv::putText(canvas_, caption, {8, 24}, cv::FONT_HERSHEY_SIMPLEX, 0.7, kText, 1, cv::LINE_AA);
  }

  void Join(const Eigen::Vector2d& left, const Eigen::Vector2d& right, const cv::Scalar& colour) {
    const cv::Point a = ToPoint(left) + cv::Point(0, kCaption_px), b = ToPoint(right) + offset_;
    cv::line(canvas_, a, b, colour, 1, cv::LINE_AA);
    cv::circle(canvas_, a, 4, colour, 1, cv::LINE_AA);
    cv::circle(canvas_, b, 4, colour, 1, cv::LINE_AA);
  }
  // Inliers above the rest.
  void Join(const std::vector<ShownMatch>& matches) {
    for (const bool inlier : {false, true}) {
      for (const ShownMatch& match : matches) {
        if (match.inlier == inlier) {
          Join(match.pixel_m, match.pixel_c, inlier ? kGood : kBad);
        }
      }
    }
  }
  const cv::Mat& canvas() const { return canvas_; }

 private:
  cv::Point offset_;
  cv::Mat canvas_;
};

}  // namespace

void WriteExplanationPng(const Explanation& explanation,
                         const std::map<int32_t, std::string>& recordings,
                         const std::string& path) {
  const cv::Mat left = ImageOf(explanation.from, recordings);
  const cv::Mat right = ImageOf(explanation.to, recordings);
  Row candidate(
      left, right,
      fmt::format("{} (match) and {} (query): {} corners look alike", ToString(explanation.from.id),
                  ToString(explanation.to.id), explanation.candidate.corner_matches.size()));
  for (const auto& [corner_c, corner_m] : explanation.candidate.corner_matches) {
    candidate.Join(explanation.from.corners.at(static_cast<size_t>(corner_m)).pixel.cast<double>(),
                   explanation.to.corners.at(static_cast<size_t>(corner_c)).pixel.cast<double>(),
                   kNeutral);
  }
  Row pnp(left, right, "points with a depth: inliers of PnP green, the rest red");
  pnp.Join(explanation.report.first);
  Row ba(left, right,
         fmt::format(
             "points found by projection: inliers of the window BA green.   {}",
             explanation.again.accepted ? "ACCEPTED" : "REFUSED: " + explanation.again.reason));
  ba.Join(explanation.report.found);
  cv::Mat picture;
  cv::vconcat(std::vector<cv::Mat>{candidate.canvas(), pnp.canvas(), ba.canvas()}, picture);
  if (!cv::imwrite(path, picture)) {
    throw std::runtime_error(fmt::format("{}: cannot be written", path));
  }
}

}  // namespace pangea::session
