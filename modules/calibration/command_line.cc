#include "calibration/command_line.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <iostream>
#include <opencv2/core/utility.hpp>

#include "calibration/calibration_folder.h"
#include "calibration/parameters.h"
#include "calibration/recording_tracks.h"
#include "calibration/summary.h"
#include "options/command_line.h"

namespace pangea::calibration {
namespace {

constexpr int kRefused = 2;  // exit code

struct Arguments {
  std::string recording, out;
  double field_of_view_deg = 0;
  std::vector<std::string> camera_axes;
  PartOfRecording part;
};

void AddOptions(CLI::App& app, Arguments& a) {
  app.add_option("recording", a.recording, "folder in EuRoC's format; sensor.yaml may be missing")
      ->required();
  app.add_option("--out", a.out, "folder to make: the recording with its calibration")->required();
  app.add_option("--fov", a.field_of_view_deg, "degrees over the image's wider side, to 10 %")
      ->check(CLI::Range(35, 130));
  app.add_option("--camera-axes", a.camera_axes,
                 "the IMU's axes along which the image's right, its down, and the line of sight "
                 "point: --camera-axes=-y,-x,-z of a phone's back camera; default: found")
      ->delimiter(',')
      ->expected(3)
      ->check(CLI::IsMember({"x", "y", "z", "-x", "-y", "-z"}));
  app.add_option("--start", a.part.start_s, "seconds to skip")->check(NotNegative());
  app.add_option("--duration", a.part.duration_s, "seconds to use")
      ->check(Positive())
      ->capture_default_str();
}

Eigen::Quaterniond RotationOf(const std::vector<std::string>& axes) {
  Eigen::Matrix3d R = Eigen::Matrix3d::Zero();
  for (int i = 0; i < 3; ++i) {
    const std::string& axis = axes[static_cast<size_t>(i)];
    R(axis.back() - 'x', i) = axis.front() == '-' ? -1 : 1;
  }
  if (R.determinant() < 0.5) {
    throw std::runtime_error(
        "--camera-axes: not a rotation; each axis once, and right x down is the line of sight");
  }
  return Eigen::Quaterniond(R);
}

EurocRecording Open(const CalibrationFolder& folder) try {
  EurocRecording recording(folder.part());
  for (const std::string& warning : recording.warnings()) {
    std::cerr << fmt::format("pangea-calibrate: {}\n", folder.AboutTheRecording(warning));
  }
  return recording;
} catch (const std::runtime_error& error) {
  throw std::runtime_error(folder.AboutTheRecording(error.what()));
}

int Run(const Arguments& a) {
  std::optional<Eigen::Quaterniond> q_body_cam;
  if (!a.camera_axes.empty()) {
    q_body_cam = RotationOf(a.camera_axes);
  }
  CalibrationFolder folder(a.recording, a.out);
  Input input = TracksOf(Open(folder), a.part, q_body_cam);
  input.check_rotation = true;
  if (a.field_of_view_deg > 0) {
    input.field_of_view = kDegree * a.field_of_view_deg;
  }
  const Result result = Calibrate(input);
  const std::string summary = Summary(input, result);
  std::cout << summary;
  if (!result.refused.empty()) {
    return kRefused;
  }
  folder.Finish(result, input.imu_noise, summary);
  return OutputIsWritten("pangea-calibrate") ? 0 : 1;
}

}  // namespace

int RunCommandLine(int argc, char** argv) {
  CLI::App app("Calibrates camera and IMU on a hand-held recording of 20 to 60 s",
               "pangea-calibrate");
  AddVersion(app);
  Arguments arguments;
  AddOptions(app, arguments);
  app.footer(fmt::format(
      "Exit code: 0; 1 when something could not be done; {} when the motion does not tell.",
      kRefused));
  CLI11_PARSE(app, argc, argv);
  try {
    cv::setNumThreads(1);  // one thread: reproducible results
    return Run(arguments);
  } catch (const std::exception& error) {
    return Failed("pangea-calibrate", error);
  }
}

}  // namespace pangea::calibration
