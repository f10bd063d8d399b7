#pragma once

// Visual-inertial odometry of one agent (the paper, section IV.A): images and inertial samples in,
// the pose at every image and finished keyframes out.
//
// Tracker -> Estimator -> (at a keyframe) Describer. A keyframe comes out once, complete and final,
// when the estimator's window lets it go. An estimator that is lost ends the map: its window is
// dropped as suspect and a new map, with ids from 0, begins with the next image.
// No thread, clock or file: the same input gives the same output.

#include <cstdint>
#include <functional>
#include <map>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/keyframe.h"
#include "vio/front_end/describer.h"
#include "vio/front_end/tracker.h"
#include "vio/window/estimator.h"

namespace pangea::vio {

struct VioOptions {
  TrackerOptions tracker;
  DescriberOptions describer;
  EstimatorOptions estimator;

  template <typename Archive>
  void Visit(Archive& archive) {
    archive.Section("tracker", &tracker, "features from image to image");
    archive.Section("describer", &describer, "corners and descriptors of a keyframe");
    archive.Section("estimator", &estimator, "the window");
  }
};

struct VioOutput {
  int64_t utime = 0;  // of the image
  EstimatorState state = EstimatorState::kInitialising;
  std::string reason;  // why it is not tracking
  MapId map;
  Rigid3 T_odom_body;  // valid while tracking
  Eigen::Vector3d v_odom_body = Eigen::Vector3d::Zero();
  BodyMotion motion;  // from there on
  int num_tracked = 0;
  // How well the scale is known, a share: of the newest keyframe that tells.
  std::optional<double> scale_sigma;
  bool imu_contradicted = false;    // it feels an acceleration that the images do not show
  bool is_keyframe = false;         // it was described, and will be finished as a keyframe later
  std::vector<Keyframe> keyframes;  // finished by this image
};

class Vio {
 public:
  // `open_map` gives the opened_utime of each new map: the wall clock, or what a test fixes.
  using OpenMap = std::function<int64_t()>;
  Vio(int32_t agent_id, const CameraModel& camera, const ImuNoise& noise, const VioOptions& options,
      OpenMap open_map);

  // Images in time order. `imu`: all samples after those of the previous call, up to and including
  // the first one at or after ImuTimeOf(utime).
  VioOutput AddImage(int64_t utime, const cv::Mat& image, std::span<const ImuSample> imu);
  // The same with given tracks instead of the tracker's.
  VioOutput AddTracks(const TrackedFrame& frame, const cv::Mat& image,
                      std::span<const ImuSample> imu);
  // The keyframes still in the window, at the end.
  std::vector<Keyframe> Flush();
  // The same, and a new map: what comes next is from another time, perhaps an earlier one.
  std::vector<Keyframe> StartAnew();

  // The IMU's time of an image's last row.
  int64_t ImuTimeOf(int64_t image_utime) const;
  const MapId& map() const { return map_; }
  int maps_opened() const { return maps_opened_; }
  // The newest image when it became a keyframe, and the window around it. Looking changes nothing.
  struct View {
    CameraModel camera;
    std::vector<Corner> corners;  // as a global shutter would have seen them
    WindowPoses window;
  };
  // `output`: of that image.
  View NewestKeyframe(const VioOutput& output) const;
  // Goes into the keyframes: the newest correction applied to this map.
  void set_group_revision(int64_t revision) { group_revision_ = revision; }

 private:
  void OpenNewMap();
  int64_t ImuTimeOfRow(int64_t image_utime, double row) const;  // row: 0 the first, 1 the last
  Eigen::Quaterniond CameraRotation(int64_t utime);
  VioOutput Estimate(const TrackedFrame& frame, const cv::Mat& image,
                     std::span<const ImuSample> imu);
  std::vector<Keyframe> Complete(const std::vector<FinishedKeyframe>& finished);
  Keyframe Complete(const FinishedKeyframe& finished);
  std::vector<MapPoint> Points(const FinishedKeyframe& finished,
                               const std::vector<Corner>& corners) const;

  int32_t agent_id_;
  CameraModel camera_;
  ImuNoise noise_;
  VioOptions options_;
  OpenMap open_map_;
  Tracker tracker_;
  Describer describer_;
  std::optional<Estimator> estimator_;
  MapId map_;
  int maps_opened_ = 0;
  int32_t next_seq_ = 0;
  int64_t group_revision_ = 0;
  std::optional<double> scale_sigma_;
  Eigen::Vector3d gyro_bias_ = Eigen::Vector3d::Zero();
  std::vector<ImuSample> rotation_imu_;  // samples the next rotation of the camera needs
  std::optional<int64_t> last_utime_;
  std::map<int64_t, std::vector<Corner>> described_;  // keyframes in the window, by utime
};

}  // namespace pangea::vio
