#pragma once

// Visual-inertial odometry of one agent (the paper, section IV.A): images and inertial samples in,
// the pose at every image and finished keyframes out.
//
// Tracker -> Estimator -> (at a keyframe) Describer. A keyframe is output once, complete and final,
// when it leaves the estimator's window. If the estimator is lost, the map ends: the keyframes in
// its window are discarded as unreliable, and the next image begins a new map, with ids from 0.
// Uses no thread, clock or file: the same input gives the same output.

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
#include "vio/front_end/gyro_rotation.h"
#include "vio/front_end/repeat_stamps.h"
#include "vio/front_end/repeated_images.h"
#include "vio/front_end/tags/tag_detector.h"
#include "vio/front_end/tracker.h"
#include "vio/window/estimator.h"

namespace pangea::vio {

struct VioOptions {
  TrackerOptions tracker;
  DescriberOptions describer;
  EstimatorOptions estimator;
  bool tags = true;

  template <typename Archive>
  void Visit(Archive& archive) {
    archive.Section("tracker", &tracker, "features from image to image");
    archive.Section("describer", &describer, "corners and descriptors of a keyframe");
    archive.Section("estimator", &estimator, "the window");
    archive.Add("tags", &tags, "AprilTags are looked for in keyframes");
  }
};

struct VioOutput {
  int64_t utime = 0;  // of the image
  EstimatorState state = EstimatorState::kInitialising;
  std::string reason;   // why it is not tracking
  std::string suspect;  // what is probably wrong with the calibration; empty: not known
  // The image is a copy of the last new one (repeated_images.h): it has no pose, and neither have
  // the values below.
  bool repeats = false;
  MapId map;
  Rigid3 T_odom_body;  // valid if state is kTracking
  Eigen::Vector3d v_odom_body = Eigen::Vector3d::Zero();
  BodyMotion motion;  // from this image on (rolling shutter)
  int num_tracked = 0;
  // Relative sigma of the scale, from the newest keyframe with enough depths to estimate it.
  std::optional<double> scale_sigma;
  bool stationary = false;          // the body is, and its pose is held
  bool imu_contradicted = false;    // it measures an acceleration that the images do not show
  bool is_keyframe = false;         // corners are described; the keyframe is finished later
  std::vector<Keyframe> keyframes;  // those that this image finished
};

class Vio {
 public:
  // `open_map` returns the opened_utime of each new map: the wall clock, or a fixed value in tests.
  using OpenMap = std::function<int64_t()>;
  Vio(int32_t agent_id, const CameraModel& camera, const ImuNoise& noise, const VioOptions& options,
      OpenMap open_map);

  // Images must come in time order. `imu`: all samples after those of the previous call, up to and
  // including the first one at or after ImuTimeOf(utime). If images repeat and the last stamp is
  // the right one (repeat_stamps.h), the result is that of the image before, when it is known.
  VioOutput AddImage(int64_t utime, const cv::Mat& image, std::span<const ImuSample> imu);
  // The same, with given tracks instead of those of the tracker.
  VioOutput AddTracks(const TrackedFrame& frame, const cv::Mat& image,
                      std::span<const ImuSample> imu);
  // At the end: finishes and returns the keyframes that are still in the window.
  std::vector<Keyframe> Flush();
  // Like Flush, and begins a new map: the next image may have any stamp, even an earlier one.
  std::vector<Keyframe> StartAnew();

  // The time, on the IMU's clock, at which the image's last row was exposed (microseconds).
  int64_t ImuTimeOf(int64_t image_utime) const;
  const MapId& map() const { return map_; }
  int maps_opened() const { return maps_opened_; }
  // The newest image, if it became a keyframe, and the window at that time.
  struct View {
    CameraModel camera;
    std::vector<Corner> corners;  // as a global shutter would see them
    DescriptorKind descriptor_kind = DescriptorKind::kOrb;
    WindowPoses window;
  };
  // `output`: the result of AddImage or AddTracks for that image. Changes no state.
  View NewestKeyframe(const VioOutput& output) const;
  // Notes the revision of the newest correction, which is written into the map's keyframes. Ignored
  // for another map.
  void NoteCorrection(const MapId& map, int64_t revision);

 private:
  void OpenNewMap();
  int64_t ImuTimeOfRow(int64_t image_utime, double row) const;  // row: 0 first, 1 last
  Eigen::Quaterniond CameraRotation(int64_t from_imu_utime, int64_t to_imu_utime,
                                    const Eigen::Vector3d& gyro_bias) const;
  Eigen::Quaterniond RotationSinceNew(int64_t utime) const;
  Eigen::Quaterniond CalibratedRotation(int64_t from_utime, int64_t to_utime) const;
  bool Repeats(int64_t utime, const cv::Mat& image) const;
  std::vector<ImuSample> TakeImuUntil(int64_t image_utime);
  VioOutput AddRepeat(int64_t utime);
  VioOutput AddNewImage(int64_t utime, const cv::Mat& image);
  VioOutput ChangeStamps();
  VioOutput Hold(const TrackedFrame& frame, const cv::Mat& image);
  Eigen::Vector3d DownInCamera(const FrameResult& result, std::span<const ImuSample> imu) const;
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
  RepeatedImages repeated_images_;
  RepeatStamps repeat_stamps_;
  Describer describer_;
  std::optional<TagDetector> tag_detector_;
  std::optional<Estimator> estimator_;
  MapId map_;
  bool map_has_poses_ = false;
  bool in_doubt_ = false;  // whether the gyro's rotations are right for the camera
  int maps_opened_ = 0;
  int32_t next_seq_ = 0;
  int64_t group_revision_ = 0;
  std::optional<double> scale_sigma_;
  Eigen::Vector3d gyro_bias_ = Eigen::Vector3d::Zero();
  GyroRotation gyro_rotation_;
  std::vector<ImuSample> waiting_imu_;  // not yet seen by the estimator
  std::optional<int64_t> last_utime_;   // of the last new image
  bool last_stamp_is_right_ = false;    // of images that repeat
  // The newest image, which may come again, if its last stamp is the right one.
  struct HeldImage {
    TrackedFrame frame;
    cv::Mat image;
  };
  std::optional<HeldImage> held_;
  struct Described {
    std::vector<Corner> corners;
    std::vector<TagObservation> tags;
  };
  std::map<int64_t, Described> described_;  // the window's keyframes, by utime
};

}  // namespace pangea::vio
