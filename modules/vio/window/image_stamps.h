#pragma once

// Estimates, from the stamps of images, how far these differ from the time of the image, which is
// the middle of the exposure. A phone stamps the start or the end of the exposure, or the arrival
// of the image. In the dark a camera exposes longer and, if needed, takes fewer images per second:
// then the middle of the exposure moves with the interval between images
// (WindowState::interval_share).

#include <cstdint>
#include <deque>

#include "core/camera_model.h"
#include "vio/window/stamp_jitter.h"

namespace pangea::vio {

class ImageStamps {
 public:
  // Stamps of a global shutter are taken to be at the middle of the exposure, by its calibration.
  explicit ImageStamps(const CameraModel& camera) : exposure_is_known_(camera.readout_s <= 0) {}

  void AddImage(int64_t utime);
  // The present interval becomes the reference.
  void SetReference() { reference_s_ = interval_s(); }
  bool has_reference() const { return reference_s_ > 0; }
  // The median interval of the last few images, minus the reference; 0 if there is no reference, or
  // if jitter explains the difference.
  double excess_interval_s() const;
  // Standard deviation of a stamp's error. With jitter: that of the jitter. Without, once the
  // exposure has changed the interval: that of the middle of the exposure, which may be up to half
  // an interval off. Otherwise 0.
  double sigma_s() const;

 private:
  double interval_s() const;  // 0: too few images
  // Whether two intervals differ by more than jitter explains.
  bool IsDifferent(double a_s, double b_s) const;

  bool exposure_is_known_;
  StampJitter jitter_;
  std::deque<int64_t> utimes_;
  double shortest_s_ = 0, longest_s_ = 0;  // extreme intervals so far; 0: none
  double reference_s_ = 0;
};

}  // namespace pangea::vio
