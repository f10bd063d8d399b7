#include "sim/euroc_writer.h"

#include <fmt/format.h>

#include <filesystem>
#include <opencv2/imgcodecs.hpp>
#include <stdexcept>

#include "files/text_file.h"

namespace pangea::sim {
namespace {

namespace fs = std::filesystem;

std::string TransformYaml(const Rigid3& T) {
  const Eigen::Matrix3d R = T.R();
  std::string text = "T_BS:\n  cols: 4\n  rows: 4\n  data: [";
  for (int i = 0; i < 3; ++i) {
    text += fmt::format("{:.14g}, {:.14g}, {:.14g}, {:.14g},\n         ", R(i, 0), R(i, 1), R(i, 2),
                        T.t[i]);
  }
  return text + "0.0, 0.0, 0.0, 1.0]\n";
}

}  // namespace

void WritePng(const std::string& path, const cv::Mat& image) {
  if (!cv::imwrite(path, image, {cv::IMWRITE_PNG_COMPRESSION, 1})) {
    throw std::runtime_error(fmt::format("{}: cannot be written", path));
  }
}

EurocWriter::EurocWriter(const std::string& folder)
    : complete_((fs::path(folder) / "mav0").string()), mav0_(complete_ + ".partial") {
  if (fs::exists(complete_)) {
    throw std::runtime_error(
        fmt::format("{}: holds a recording already; name another --out or remove it", complete_));
  }
  fs::remove_all(mav0_);  // of a run that was interrupted
  for (const char* name : {"cam0/data", "imu0", "state_groundtruth_estimate0"}) {
    fs::create_directories(fs::path(mav0_) / name);
  }
}

EurocWriter EurocWriter::Begun(const std::string& folder) {
  EurocWriter writer;
  writer.complete_ = (fs::path(folder) / "mav0").string();
  writer.mav0_ = writer.complete_ + ".partial";
  return writer;
}

void EurocWriter::Finish() const { fs::rename(mav0_, complete_); }

void EurocWriter::WriteText(const std::string& file, const std::string& text) const {
  WriteTextFile(mav0_ + "/" + file, text);
}

void EurocWriter::WriteBody(const std::string& comment) const {
  WriteText("body.yaml", fmt::format("comment: {}\n", comment));
}

void EurocWriter::WriteCamera(const CameraModel& camera, double rate_hz,
                              const std::string& comment) const {
  std::string text =
      fmt::format("# General sensor definitions.\nsensor_type: camera\ncomment: {}\n\n", comment);
  text += "# Sensor extrinsics wrt. the body-frame.\n" + TransformYaml(camera.T_body_cam);
  text += fmt::format(
      "\n# Camera specific definitions.\nrate_hz: {:g}\nresolution: [{}, {}]\n"
      "camera_model: pinhole\nintrinsics: [{:.10g}, {:.10g}, {:.10g}, {:.10g}] #fu, fv, cu, cv\n",
      rate_hz, camera.width, camera.height, camera.fx, camera.fy, camera.cx, camera.cy);
  const Eigen::Vector4d& k = camera.distortion;
  text += fmt::format(
      "distortion_model: {}\ndistortion_coefficients: [{:.10g}, {:.10g}, {:.10g}, {:.10g}]\n",
      camera.kind == CameraModel::Kind::kRadtan ? "radial-tangential" : "equidistant", k[0], k[1],
      k[2], k[3]);
  if (camera.time_offset_s != 0) {
    text +=
        fmt::format("time_offset_s: {:.10g} # t_imu = t_image + offset\n", camera.time_offset_s);
  }
  if (camera.readout_s != 0) {
    text += fmt::format("readout_s: {:.10g} # first row to last; stamps are the first row's\n",
                        camera.readout_s);
  }
  WriteText("cam0/sensor.yaml", text);
}

void EurocWriter::WriteImuCalibration(const ImuNoise& noise) const {
  WriteText(
      "imu0/sensor.yaml",
      "#Default imu sensor yaml file\nsensor_type: imu\ncomment: VI-Sensor IMU (ADIS16448)\n\n"
      "# Sensor extrinsics wrt. the body-frame.\n" +
          TransformYaml(Rigid3()) +
          fmt::format("rate_hz: {:g}\n\n# inertial sensor noise model parameters (static)\n"
                      "gyroscope_noise_density: {:.4e}     # [ rad / s / sqrt(Hz) ]   ( gyro "
                      "\"white noise\" )\n"
                      "gyroscope_random_walk: {:.4e}       # [ rad / s^2 / sqrt(Hz) ] ( gyro bias "
                      "diffusion )\n"
                      "accelerometer_noise_density: {:.4e} # [ m / s^2 / sqrt(Hz) ]   ( accel "
                      "\"white noise\" )\n"
                      "accelerometer_random_walk: {:.4e}   # [ m / s^3 / sqrt(Hz) ].  ( accel bias "
                      "diffusion )\n",
                      noise.rate_hz, noise.gyro_noise_density, noise.gyro_random_walk,
                      noise.accel_noise_density, noise.accel_random_walk));
}

void EurocWriter::WriteImu(const SimulatedImu& imu) const {
  std::string text = kImuHeader;
  for (size_t i = 0; i < imu.samples.size(); ++i) {
    const Eigen::Vector3d& w = imu.samples[i].gyro;
    const Eigen::Vector3d& a = imu.samples[i].accel;
    text += fmt::format("{},{:.10f},{:.10f},{:.10f},{:.10f},{:.10f},{:.10f}\n", imu.stamps_ns[i],
                        w.x(), w.y(), w.z(), a.x(), a.y(), a.z());
  }
  WriteText("imu0/data.csv", text);
}

void EurocWriter::WriteGroundTruth(const SplinePath& path, const std::vector<int64_t>& stamps_ns,
                                   const SimulatedImu* imu) const {
  std::string text =
      "#timestamp [ns],p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m],q_RS_w [],q_RS_x [],q_RS_y [],"
      "q_RS_z []";
  if (imu != nullptr) {
    text +=
        ",v_RS_R_x [m s^-1],v_RS_R_y [m s^-1],v_RS_R_z [m s^-1],b_w_RS_S_x [rad s^-1],"
        "b_w_RS_S_y [rad s^-1],b_w_RS_S_z [rad s^-1],b_a_RS_S_x [m s^-2],b_a_RS_S_y [m s^-2],"
        "b_a_RS_S_z [m s^-2]";
  }
  text += '\n';
  for (size_t i = 0; i < stamps_ns.size(); ++i) {
    const PathState state = path.At(stamps_ns[i]);
    const Eigen::Vector3d& p = state.T_ref_body.t;
    const Eigen::Quaterniond& q = state.T_ref_body.q;
    text += fmt::format("{},{:.9f},{:.9f},{:.9f},{:.9f},{:.9f},{:.9f},{:.9f}", stamps_ns[i], p.x(),
                        p.y(), p.z(), q.w(), q.x(), q.y(), q.z());
    if (imu != nullptr) {
      for (const Eigen::Vector3d& v : {state.v_ref_body, imu->gyro_bias[i], imu->accel_bias[i]}) {
        text += fmt::format(",{:.9f},{:.9f},{:.9f}", v.x(), v.y(), v.z());
      }
    }
    text += '\n';
  }
  WriteText("state_groundtruth_estimate0/data.csv", text);
  WriteText("state_groundtruth_estimate0/sensor.yaml",
            "# General sensor definitions.\nsensor_type: visual-inertial\n"
            "comment: The path the images were rendered along.\n\n"
            "# Sensor extrinsics wrt. the body-frame.\n" +
                TransformYaml(Rigid3()));
}

void EurocWriter::WriteImageList(const std::vector<int64_t>& stamps_ns) const {
  std::string text = "#timestamp [ns],filename\n";
  for (const int64_t stamp : stamps_ns) {
    text += fmt::format("{},{}.png\n", stamp, stamp);
  }
  WriteText("cam0/data.csv", text);
}

void EurocWriter::WriteImage(int64_t stamp_ns, const cv::Mat& image) const {
  WritePng(fmt::format("{}/cam0/data/{}.png", mav0_, stamp_ns), image);
}

}  // namespace pangea::sim
