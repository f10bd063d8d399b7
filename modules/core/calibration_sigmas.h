#pragma once

// How well a camera's calibration is known before the images say more: standard deviations.

namespace pangea {

struct CalibrationSigmas {
  // rad; constraints of walks need it (docs/decisions/imu.md)
  double rotation = 0.001;
  double position_m = 0.005;
  double time_offset_s = 0.005;
  double focal = 0.001;   // of the focal length
  double centre = 0.001;  // of the focal length: half a pixel
  // Of the first two coefficients. 0: a tenth of a pixel in a corner (0.0003); where all are 0,
  // nobody measured them, and phones' lenses have up to 0.1.
  double distortion = 0;

  template <typename Archive>
  void Visit(Archive& archive) {
    archive.Add("rotation", &rotation, {1e-6, 1}, "rad", "of the camera in the body");
    archive.Add("position_m", &position_m, {1e-6, 1}, "m", "of the camera in the body");
    archive.Add("time_offset_s", &time_offset_s, {1e-6, 0.1}, "s", "of the clocks");
    archive.Add("focal", &focal, {1e-6, 0.2}, "", "of the focal length, as a share of it");
    archive.Add("centre", &centre, {1e-6, 0.2}, "", "of the image's centre, in focal lengths");
    archive.Add("distortion", &distortion, {0, 1}, "",
                "of the first two coefficients; 0: 0.1 where they are all 0, else 0.0003");
  }
};

}  // namespace pangea
