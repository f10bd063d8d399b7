#pragma once

// Renders a whole recording: path, scene, IMU, images, ground truth, in EuRoC's format.
//
//   RecordingOptions options;
//   options.out = "recording";
//   options.generated.duration_s = 10;
//   RenderRecording(options);
//
// The same options give the same bytes, on any number of threads.

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "core/camera_model.h"
#include "core/imu/imu.h"
#include "sim/path/path_generator.h"
#include "sim/path/path_steps.h"
#include "sim/path/spline_path.h"
#include "sim/render/cameras.h"
#include "sim/render/sensor.h"
#include "sim/scene/scene_builder.h"

namespace pangea::sim {

struct RecordingOptions {
  std::string out;  // folder that will hold mav0

  // The path: from a file (EuRoC ground-truth csv or TUM), or generated if this is empty.
  std::string path_file;
  GeneratedPathOptions generated;
  SplinePathOptions spline;
  StepOptions steps;
  double start_s = 0;
  double duration_s = 0;  // 0: to the end

  SceneOptions scene;
  std::vector<std::string> keep_clear_files;  // in addition to the path's own file

  CameraModel camera = EurocCamera();
  double image_rate_hz = 20;
  SensorOptions sensor;
  ImuNoise imu;

  // A recorded IMU and the stamps of its camera, instead of simulated ones.
  std::string imu_file;
  std::string stamps_file;

  uint64_t seed = 1;     // pixel noise, exposure and IMU noise
  bool perfect = false;  // no noise, no blur, no changing exposure, exact IMU
  bool tracks = false;   // cam0/tracks.csv with exact feature tracks

  std::string cache_dir;  // cache of noise-free frames; empty: none
  int threads = 0;        // 0: one per core
};

struct RecordingSummary {
  size_t images = 0;
  size_t rendered = 0;  // the others came from the cache
  double path_m = 0;
  double largest_acceleration = 0;  // m/s^2
  size_t steps_spread = 0;
};

// Called with (frames done, frames in all), from one thread at a time.
using Progress = std::function<void(size_t, size_t)>;

// Throws std::runtime_error with a one-line message for the user.
RecordingSummary RenderRecording(const RecordingOptions& options, const Progress& progress = {});

}  // namespace pangea::sim
