#pragma once

// Prior standard deviations of a camera's calibration, before any image was seen.

namespace pangea {

struct CalibrationSigmas {
  // rad; constraints measured while walking need this value (docs/decisions/imu.md)
  double rotation = 0.001;
  double position_m = 0.005;
  double time_offset_s = 0.005;
  double focal = 0.001;   // share of the focal length
  double centre = 0.001;  // share of the focal length; this is about half a pixel
  // Of the first two distortion coefficients. The value 0 stands for 0.0003 (a tenth of a pixel in
  // an image corner), or for 0.1 when all coefficients are 0: then nobody measured them.
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
