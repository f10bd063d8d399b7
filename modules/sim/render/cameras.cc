#include "sim/render/cameras.h"

namespace pangea::sim {

CameraModel EurocCamera() {
  CameraModel camera;
  camera.width = 752;
  camera.height = 480;
  camera.fx = 458.654;
  camera.fy = 457.296;
  camera.cx = 367.215;
  camera.cy = 248.375;
  camera.distortion << -0.28340811, 0.07395907, 0.00019359, 1.76187114e-05;
  Eigen::Matrix3d R_body_cam;
  R_body_cam << 0.0148655429818, -0.999880929698, 0.00414029679422, 0.999557249008, 0.0149672133247,
      0.025715529948, -0.0257744366974, 0.00375618835797, 0.999660727178;
  camera.T_body_cam = Rigid3(Eigen::Quaterniond(R_body_cam).normalized(),
                             {-0.0216401454975, -0.064676986768, 0.00981073058949});
  return camera;
}

CameraModel PhoneCamera() {
  CameraModel camera;
  camera.kind = CameraModel::Kind::kEquidistant;
  camera.width = 640;
  camera.height = 480;
  camera.fx = 445.2;
  camera.fy = 445.9;
  camera.cx = 318.4;
  camera.cy = 243.1;
  camera.distortion << 0.021, -0.012, 0.004, -0.001;
  camera.readout_s = 0.012;
  // Held upright in landscape orientation, looking ahead: the body's z axis points out of the
  // screen.
  Eigen::Matrix3d R_body_cam;
  R_body_cam << 0, 1, 0, 1, 0, 0, 0, 0, -1;
  camera.T_body_cam = Rigid3(Eigen::Quaterniond(R_body_cam).normalized(), {0.04, 0.01, -0.005});
  return camera;
}

CameraModel WideCamera() {
  CameraModel camera;
  camera.kind = CameraModel::Kind::kEquidistant;
  camera.width = 512;
  camera.height = 512;
  camera.fx = 190.978;
  camera.fy = 190.973;
  camera.cx = 254.932;
  camera.cy = 256.897;
  camera.distortion << 0.0034824, 0.00071503, -0.0020532, 0.00020294;
  camera.T_body_cam = PhoneCamera().T_body_cam;
  return camera;
}

CameraModel Shrunk(const CameraModel& camera, double factor) {
  CameraModel shrunk = camera;
  shrunk.width = static_cast<int>(camera.width / factor);
  shrunk.height = static_cast<int>(camera.height / factor);
  shrunk.fx /= factor;
  shrunk.fy /= factor;
  // Pixel centres are at whole numbers, so edges are at -0.5.
  shrunk.cx = (camera.cx + 0.5) / factor - 0.5;
  shrunk.cy = (camera.cy + 0.5) / factor - 0.5;
  return shrunk;
}

}  // namespace pangea::sim
