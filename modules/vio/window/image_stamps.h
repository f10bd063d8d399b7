#pragma once

// What the stamps of images tell of when these were taken. What counts is the middle of the
// exposure; a phone's stamps are of its begin, of its end or of the image's arrival. In the dark a
// camera exposes longer, and where it has to it takes fewer images a second: then the middle moves
// with the interval between images (WindowState::interval_share).

#include <cstdint>
#include <deque>

#include "core/camera_model.h"
#include "vio/window/stamp_jitter.h"

namespace pangea::vio {

class ImageStamps {
 public:
  // A global shutter's stamps are of the middle: its calibration saw to that.
  explicit ImageStamps(const CameraModel& camera) : exposure_is_known_(camera.readout_s <= 0) {}

  void AddImage(int64_t utime);
  // What the interval is now is the reference.
  void SetReference() { reference_s_ = interval_s(); }
  bool has_reference() const { return reference_s_ > 0; }
  // The last few images' interval (one that is missing does not count), less the reference; 0 while
  // there is none, and within what jitter makes of equal intervals.
  double excess_interval_s() const;
  // Standard deviation of a stamp's error: of jitter; of stamps without it that of the exposure's
  // middle, anything up to half an interval off, once the exposure has changed the interval. 0:
  // none that matters.
  double sigma_s() const;

 private:
  double interval_s() const;  // 0: too few images
  // By more than jitter makes of it.
  bool IsDifferent(double a_s, double b_s) const;

  bool exposure_is_known_;
  StampJitter jitter_;
  std::deque<int64_t> utimes_;
  double shortest_s_ = 0, longest_s_ = 0;  // interval so far; 0: none
  double reference_s_ = 0;
};

}  // namespace pangea::vio
