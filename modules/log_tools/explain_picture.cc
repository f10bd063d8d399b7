#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <stdexcept>

#include "log_tools/explain.h"
#include "recording/euroc.h"

namespace pangea {
namespace {

// Colours by Okabe and Ito, distinguishable with any colour vision (BGR).
const cv::Scalar kGood(115, 158, 0), kBad(0, 94, 213), kNeutral(233, 180, 86), kText(255, 255, 255);
constexpr int kCaption_px = 34;
constexpr int kBetween_px = 4;  // between the two images

// The image nearest to the keyframe in time, in colour; dark if there is none.
cv::Mat ImageOf(const Keyframe& keyframe, const SessionRecord& recordings) {
  cv::Mat image(keyframe.camera.height, keyframe.camera.width, CV_8UC3, cv::Scalar(40, 40, 40));
  const std::optional<std::string> folder = RecordingOf(keyframe.id.map, recordings);
  if (!folder) {
    return image;
  }
  const EurocRecording recording(*folder);
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

// A line of text, as wide as the rows.
cv::Mat Caption(const std::string& text, int width, const cv::Scalar& colour = kText) {
  cv::Mat strip(kCaption_px, width, CV_8UC3, cv::Scalar(0, 0, 0));
  cv::putText(strip, text, {8, 24}, cv::FONT_HERSHEY_SIMPLEX, 0.7, colour, 1, cv::LINE_AA);
  return strip;
}

// Both images side by side, with the matches.
class Row {
 public:
  Row(const cv::Mat& left, const cv::Mat& right)
      : right_at_(left.cols + kBetween_px, 0),
        canvas_(std::max(left.rows, right.rows), left.cols + kBetween_px + right.cols, CV_8UC3,
                cv::Scalar(0, 0, 0)) {
    left.copyTo(canvas_(cv::Rect(0, 0, left.cols, left.rows)));
    right.copyTo(canvas_(cv::Rect(right_at_.x, 0, right.cols, right.rows)));
  }

  void Join(const Eigen::Vector2d& left, const Eigen::Vector2d& right, const cv::Scalar& colour) {
    const cv::Point a = ToPoint(left), b = ToPoint(right) + right_at_;
    cv::line(canvas_, a, b, colour, 1, cv::LINE_AA);
    cv::circle(canvas_, a, 4, colour, 1, cv::LINE_AA);
    cv::circle(canvas_, b, 4, colour, 1, cv::LINE_AA);
  }
  // Draws inliers above the others.
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
  cv::Point right_at_;
  cv::Mat canvas_;
};

// Keyframe images and their joint width.
struct Pair {
  cv::Mat left, right;

  int width() const { return left.cols + kBetween_px + right.cols; }
};

cv::Mat CandidateRow(const Explanation& explanation, const Pair& images) {
  Row row(images.left, images.right);
  for (const auto& [corner_c, corner_m] : explanation.candidate.corner_matches) {
    row.Join(explanation.from.corners.at(static_cast<size_t>(corner_m)).pixel.cast<double>(),
             explanation.to.corners.at(static_cast<size_t>(corner_c)).pixel.cast<double>(),
             kNeutral);
  }
  return row.canvas();
}

cv::Mat MatchesRow(const std::vector<ShownMatch>& matches, const Pair& images) {
  Row row(images.left, images.right);
  row.Join(matches);
  return row.canvas();
}

// The result, with its most important values.
std::string ResultOf(const Explanation& explanation) {
  const Constraint& result = explanation.again;
  const LoopVerificationReport& report = explanation.report;
  std::string text =
      fmt::format("{}   ({:.0f} % found of {} points that ought to be seen",
                  result.accepted ? "ACCEPTED" : "REFUSED: " + result.reason,
                  100 * report.Measured("min_found_share"), report.Measured("min_comparable"));
  if (const double landmarks = report.Measured("min_inliers"); landmarks > 0) {
    text += fmt::format("; {} landmarks in {} of the image's 24 cells", landmarks,
                        report.Measured("min_occupied_cells"));
  }
  return text + ")";
}

}  // namespace

void WriteExplanationPng(const Explanation& explanation, const SessionRecord& recordings,
                         const std::string& path) {
  if (std::filesystem::path(path).extension() != ".png") {
    throw std::runtime_error(fmt::format("{}: give a name that ends in .png", path));
  }
  const Pair images{ImageOf(explanation.from, recordings), ImageOf(explanation.to, recordings)};
  const int width = images.width();
  const LoopVerificationReport& report = explanation.report;
  std::vector<cv::Mat> parts = {
      Caption(fmt::format("{} (match) and {} (query): {} corners look alike",
                          ToString(explanation.from.id), ToString(explanation.to.id),
                          explanation.candidate.corner_matches.size()),
              width),
      CandidateRow(explanation, images),
      Caption("points with a depth: inliers of PnP green, the rest orange", width),
      MatchesRow(report.first, images)};
  if (!report.found.empty()) {
    parts.push_back(Caption(
        "points found by projection: inliers of the window BA green, the rest orange", width));
    parts.push_back(MatchesRow(report.found, images));
  }
  parts.push_back(Caption(ResultOf(explanation), width, explanation.again.accepted ? kGood : kBad));
  cv::Mat picture;
  cv::vconcat(parts, picture);
  if (!cv::imwrite(path, picture)) {
    throw std::runtime_error(fmt::format("{}: cannot be written", path));
  }
}

}  // namespace pangea
