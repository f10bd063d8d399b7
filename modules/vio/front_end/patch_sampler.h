#pragma once

// Samples the patch around a corner or blob, turned so that gravity points down in it: the roll of
// the camera, which the odometry knows, does not change the patch. Integers alone, so each platform
// gives the same patch.

#include <Eigen/Core>
#include <cstdint>
#include <opencv2/core.hpp>

#include "vio/front_end/patch_network.h"

namespace pangea::vio {

class PatchSampler {
 public:
  // `down_cam`: direction of gravity in the camera frame. Zero, or along the optical axis: the
  // patch is not turned.
  explicit PatchSampler(const Eigen::Vector3d& down_cam);

  // `centre`: pixels of `level`. `step`: width of the patch's pixels, in pixels of the level; the
  // level must be smooth enough for it. Beyond its rim, the level's outermost pixels are repeated.
  PatchNetwork::Patch Sample(const cv::Mat& level, const cv::Point2f& centre, double step) const;

 private:
  double cos_ = 1, sin_ = 0;  // of the angle
};

}  // namespace pangea::vio
