#pragma once

// Tracks features through an image stream (the paper, section IV.A, which builds on the front end
// of VINS-Mono). New features are Shi-Tomasi corners on a grid. Each is predicted by the gyro's
// rotation and its own motion, searched there by KLT, and aligned with its first appearance
// (reference_patch.h). Features that this does not confirm are searched by pyramidal KLT with a
// forward-backward check. Last comes two-view outlier rejection on undistorted rays.
//
// Input: grey images and the camera's rotation since the previous one. Output: the tracked frame.
// Landmark ids count up from 0 and are not reused until Reset. One thread; deterministic.

#include <Eigen/Geometry>
#include <cstdint>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <utility>
#include <vector>

#include "core/camera_model.h"
#include "vio/front_end/corners.h"
#include "vio/front_end/equaliser.h"
#include "vio/front_end/reference_patch.h"
#include "vio/front_end/tracks.h"
#include "vio/front_end/two_view_check.h"

namespace pangea::vio {

struct TrackerOptions {
  int max_features = 150;
  double min_distance_px = 22;  // between features
  TwoViewOptions two_view;

  template <typename Archive>
  void Visit(Archive& archive) {
    archive.Add("max_features", &max_features, {10, 2000}, "", "tracked at once");
    archive.Add("min_distance_px", &min_distance_px, {1, 1000}, "px", "between features");
    archive.Section("two_view", &two_view, "outliers between two images");
  }
};

class Tracker {
 public:
  Tracker(const CameraModel& camera, const TrackerOptions& options);

  // `q_cam_lastcam` maps directions from the previous image's camera frame to this one's. Without
  // it no outliers between the two views are found.
  const TrackedFrame& Track(int64_t utime, const cv::Mat& image,
                            const std::optional<Eigen::Quaterniond>& q_cam_lastcam);
  // Ends these tracks; the estimator calls them outliers.
  void Drop(const std::vector<int32_t>& landmark_ids);
  // Forgets all tracks; ids start again at 0 (a new map).
  void Reset();

  // For the newest image: the tracks that continued, and why the others ended.
  struct Statistics {
    int tracked = 0;
    int as_predicted = 0;  // of these, found by the cheap search at the prediction
    int lost_klt = 0;
    int lost_backward = 0;
    int lost_two_view = 0;
    int added = 0;
  };
  const Statistics& statistics() const { return statistics_; }

 private:
  struct Feature {
    int32_t id = 0;
    cv::Point2f pixel;
    Eigen::Vector2d ray = Eigen::Vector2d::Zero();
    cv::Point2f flow;                       // px/s, without the effect of the camera's rotation
    std::unique_ptr<ReferencePatch> patch;  // null: to be taken from the newest image
  };
  struct Bearing {
    int32_t id;
    Eigen::Vector2d ray;
  };

  using Pyramid = std::vector<cv::Mat>;  // each level, followed by its derivatives
  // Coarsest pyramid level of a search with a good initial guess.
  static constexpr int kNearLevel = 1;
  using Found = std::optional<Eigen::Vector2f>;  // position in the newest image

  void Prepare(const cv::Mat& image);
  std::vector<Bearing> Bearings() const;
  std::vector<uchar> Klt(const Pyramid& from_pyramid, const Pyramid& to_pyramid,
                         const std::vector<cv::Point2f>& from, int coarsest_level,
                         std::vector<cv::Point2f>* to) const;
  std::vector<uchar> KltNear(std::vector<cv::Point2f> from, std::vector<cv::Point2f>* to) const;
  std::vector<cv::Point2f> Rotated(const Eigen::Quaterniond& q_cam_lastcam);
  std::vector<Found> FindAsPredicted(const cv::Mat& image, const std::vector<cv::Point2f>& rotated,
                                     float dt_s);
  void FindOthers(const cv::Mat& image, const std::vector<cv::Point2f>& rotated,
                  std::vector<Found>* found);
  void TrackFeatures(const cv::Mat& image, const Eigen::Quaterniond& q_cam_lastcam, float dt_s);
  void TakePatches(const cv::Mat& image);
  std::vector<bool> Inliers(const Eigen::Quaterniond& q_cam_lastcam,
                            const std::vector<Bearing>& before) const;
  void KeepApart(const std::vector<bool>& inlier);
  // Examines only the cells whose turn it is; the strongest corner first.
  std::vector<RatedCorner> CornersOfEmptyCells() const;
  void AddFeatures();
  bool Inside(const cv::Point2f& pixel) const;
  void FillFrame(int64_t utime);

  CameraModel camera_;
  TrackerOptions options_;
  Equaliser equaliser_;
  Pyramid pyramid_;  // of the newest image
  Pyramid last_pyramid_;
  std::vector<Feature> features_;  // oldest first
  int32_t next_id_ = 0;
  int turn_ = 0;
  double strongest_ = 0;  // running maximum of the eigenvalue
  Statistics statistics_;
  TrackedFrame frame_;
};

}  // namespace pangea::vio
