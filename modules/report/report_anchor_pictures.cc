#include "report/report_anchor_pictures.h"

#include <fmt/format.h>

#include <cmath>
#include <memory>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <stdexcept>

#include "files/text_file.h"
#include "recording/euroc.h"
#include "report/metrics/report_counts.h"

namespace pangea {
namespace {

constexpr int kWidth_px = 640;
constexpr int kCaption_px = 30;
constexpr int64_t kMaxOff_us = 60'000;  // between image and pose
constexpr double kCubeSide = 0.1;       // relative to the distance from the maker's camera
// Colours by Okabe and Ito, distinguishable with any colour vision (BGR).
const cv::Scalar kShown(0, 159, 230), kTrue(233, 180, 86), kText(255, 255, 255);

// Images of recordings; each recording is opened once.
class Images {
 public:
  Images(const ReportMetrics& metrics, std::vector<std::string>* notes)
      : metrics_(metrics), notes_(notes) {}

  // The image, in colour, with the camera's size; empty if there is none.
  cv::Mat At(int32_t agent, int64_t utime) {
    const EurocRecording* recording = Open(agent);
    if (recording == nullptr) {
      return {};
    }
    const std::vector<EurocImage>& images = recording->images();
    size_t nearest = 0;
    int64_t off = kMaxOff_us;
    for (size_t i = 0; i < images.size(); ++i) {
      if (std::abs(images[i].utime - utime) < off) {
        off = std::abs(images[i].utime - utime);
        nearest = i;
      }
    }
    std::string why;
    cv::Mat colour;
    const cv::Mat grey = off < kMaxOff_us ? recording->LoadImage(nearest, &why) : cv::Mat();
    if (!grey.empty()) {
      cv::cvtColor(grey, colour, cv::COLOR_GRAY2BGR);
    }
    return colour;
  }

 private:
  const EurocRecording* Open(int32_t agent) {
    const auto [known, is_new] = recordings_.try_emplace(agent);
    const std::string& folder = metrics_.agents[metrics_.IndexOf(agent)].run.recording;
    if (is_new && !folder.empty() && Exists(folder)) {
      try {
        known->second = std::make_unique<EurocRecording>(folder);
      } catch (const std::runtime_error& error) {
        notes_->push_back(fmt::format("agent {}: no pictures of anchors: {}", agent, error.what()));
      }
    }
    return known->second.get();
  }

  const ReportMetrics& metrics_;
  std::vector<std::string>* notes_;
  std::map<int32_t, std::unique_ptr<EurocRecording>> recordings_;
};

// One image to draw into.
class Canvas {
 public:
  Canvas(const cv::Mat& image, const CameraModel& camera)
      : camera_(camera), scale_(static_cast<double>(kWidth_px) / image.cols) {
    cv::resize(image, canvas_, {kWidth_px, static_cast<int>(std::lround(scale_ * image.rows))}, 0,
               0, cv::INTER_AREA);
  }

  // Draws a cube that stands upright on the anchor, and a cross at the anchor itself.
  void DrawCube(const Rigid3& T_cam_anchor, double side) {
    for (int a = 0; a < 8; ++a) {
      for (const int bit : {1, 2, 4}) {
        if ((a & bit) == 0) {
          DrawLine(T_cam_anchor * Corner(a, side), T_cam_anchor * Corner(a | bit, side));
        }
      }
    }
    if (const auto at = At(T_cam_anchor.t)) {
      cv::drawMarker(canvas_, *at, kShown, cv::MARKER_CROSS, 16, 2, cv::LINE_AA);
    }
  }
  void DrawTruth(const Eigen::Vector3d& p_cam) {
    if (const auto at = At(p_cam)) {
      cv::circle(canvas_, *at, 9, kTrue, 2, cv::LINE_AA);
    }
  }
  cv::Mat WithCaption(const std::string& text) const {
    cv::Mat strip(kCaption_px, kWidth_px, CV_8UC3, cv::Scalar(0, 0, 0)), whole;
    cv::putText(strip, text, {8, 21}, cv::FONT_HERSHEY_SIMPLEX, 0.55, kText, 1, cv::LINE_AA);
    cv::vconcat(strip, canvas_, whole);
    return whole;
  }

 private:
  static Eigen::Vector3d Corner(int bits, double side) {
    return side * Eigen::Vector3d((bits & 1) != 0 ? 0.5 : -0.5, (bits & 2) != 0 ? 0.5 : -0.5,
                                  (bits & 4) != 0 ? 1 : 0);
  }
  std::optional<cv::Point> At(const Eigen::Vector3d& p_cam) const {
    const auto pixel = p_cam.z() > 0 ? camera_.Project(p_cam) : std::nullopt;
    if (!pixel || !camera_.Contains(*pixel, -camera_.width)) {
      return std::nullopt;
    }
    const Eigen::Vector2d scaled = scale_ * *pixel;
    return cv::Point(static_cast<int>(std::lround(scaled.x())),
                     static_cast<int>(std::lround(scaled.y())));
  }
  void DrawLine(const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
    const auto a = At(from), b = At(to);
    if (a && b) {
      cv::line(canvas_, *a, *b, kShown, 2, cv::LINE_AA);
    }
  }

  const CameraModel& camera_;
  double scale_;
  cv::Mat canvas_;
};

// OpenCV's fonts have only ASCII letters.
std::string Ascii(std::string text) {
  for (char& c : text) {
    c = static_cast<unsigned char>(c) < 0x80 ? c : '?';
  }
  return text;
}

// The other agent with the best view; null if there is none.
const AnchorAtAgent* BestView(const AnchorMetrics& anchor, const CapturedSession& session) {
  const AnchorAtAgent* best = nullptr;
  double best_inside = -1;
  for (const AnchorAtAgent& at : anchor.agents) {
    if (at.view) {
      const CameraModel& camera = session.cameras.at(at.agent);
      const double inside = *Inside(camera, *at.view->p_truth) / camera.width;
      if (inside > best_inside) {
        best = &at;
        best_inside = inside;
      }
    }
  }
  return best;
}

// Both images of one anchor; empty if one is missing.
cv::Mat Row(const AnchorMetrics& anchor, const CapturedSession& session,
            const ReportMetrics& metrics, Images* images) {
  const AnchorAtAgent* other = BestView(anchor, session);
  if (!anchor.placing || other == nullptr) {
    return {};
  }
  const AnchorView& placing = *anchor.placing;
  const AnchorView& seen = *other->view;
  const cv::Mat left = images->At(placing.agent, placing.utime);
  const cv::Mat right = images->At(seen.agent, seen.utime);
  if (left.cols != session.cameras.at(placing.agent).width ||
      right.cols != session.cameras.at(seen.agent).width) {
    return {};  // no image, or one of another camera
  }
  const double side = kCubeSide * placing.T_cam_anchor.t.norm();
  Canvas maker(left, session.cameras.at(placing.agent));
  maker.DrawCube(placing.T_cam_anchor, side);
  Canvas looker(right, session.cameras.at(seen.agent));
  looker.DrawTruth(*seen.p_truth);
  looker.DrawCube(seen.T_cam_anchor, side);
  const cv::Mat pair[] = {
      maker.WithCaption(
          Ascii(fmt::format("{}: agent {} places it at {:.1f} s", anchor.name, placing.agent,
                            RecordingSeconds(metrics, placing.agent, placing.utime)))),
      looker.WithCaption(fmt::format("agent {} at {:.1f} s, error {:.3f} m", seen.agent,
                                     RecordingSeconds(metrics, seen.agent, seen.utime),
                                     (seen.T_cam_anchor.t - *seen.p_truth).norm()))};
  const int rows = std::max(pair[0].rows, pair[1].rows);
  cv::Mat row(rows, 2 * kWidth_px, CV_8UC3, cv::Scalar(0, 0, 0));
  for (int i = 0; i < 2; ++i) {
    pair[i].copyTo(row(cv::Rect(i * kWidth_px, 0, kWidth_px, pair[i].rows)));
  }
  return row;
}

}  // namespace

std::string AnchorsJpeg(const CapturedSession& session, const ReportMetrics& metrics,
                        std::vector<std::string>* notes) {
  Images images(metrics, notes);
  std::vector<cv::Mat> rows;
  for (const AnchorMetrics& anchor : metrics.anchors) {
    cv::Mat row =
        rows.size() < kMaxAnchorPictures ? Row(anchor, session, metrics, &images) : cv::Mat();
    if (!row.empty()) {
      rows.push_back(std::move(row));
    }
  }
  if (rows.empty()) {
    return "";
  }
  cv::Mat picture;
  cv::vconcat(rows, picture);
  std::vector<uchar> jpeg;
  cv::imencode(".jpg", picture, jpeg, {cv::IMWRITE_JPEG_QUALITY, 85});
  return {jpeg.begin(), jpeg.end()};
}

}  // namespace pangea
