#include "sim/command_line.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <map>
#include <optional>
#include <stdexcept>

#include "core/tags/tag.h"
#include "files/progress.h"
#include "options/command_line.h"
#include "sim/recording.h"
#include "sim/render/frame_cache.h"

namespace pangea::sim {
namespace {

const std::map<std::string, SceneKind> kScenes = {
    {"hall", SceneKind::kHall},
    {"room", SceneKind::kRoom},
    {"twin_objects_a", SceneKind::kTwinObjectsA},
    {"twin_objects_b", SceneKind::kTwinObjectsB},
    {"bare", SceneKind::kBareHall},
    {"rows_a", SceneKind::kRowsA},
    {"rows_b", SceneKind::kRowsB},
};

CameraModel CameraOf(const std::string& name) {
  if (name == "euroc") {
    return EurocCamera();
  }
  return name == "phone" ? PhoneCamera() : WideCamera();
}

class CommandLine {
 public:
  // Adds its options to `app`; both must exist until Run has returned.
  explicit CommandLine(CLI::App& app);
  // Throws std::runtime_error with a one-line message for the user.
  void Run();

 private:
  void AddPath(CLI::App& app);
  void AddScene(CLI::App& app);
  void AddSensors(CLI::App& app);
  void Apply();
  RecordingSummary Render() const;

  RecordingOptions options_;
  std::string generate_ = "walk";
  std::string scene_ = "hall";
  std::string camera_ = "euroc";
  std::optional<int> first_tag_;
  double tag_size_m_ = WallTags{}.size_m;
  double shrink_ = 1;
  double knot_spacing_s_ = 0;
  double exposure_ms_ = 3;
  bool no_cache_ = false;
};

CommandLine::CommandLine(CLI::App& app) {
  app.add_option("--out", options_.out, "folder that will hold mav0/")->required();
  app.add_option("--seed", options_.seed,
                 "of pixel noise, exposure changes, IMU noise and biases; nothing else")
      ->capture_default_str();
  AddPath(app);
  AddScene(app);
  AddSensors(app);
  options_.cache_dir = DefaultCacheRoot();
  app.add_option("--cache", options_.cache_dir, "folder of noise-free frames, kept between runs")
      ->capture_default_str();
  app.add_flag("--no-cache", no_cache_, "keep no noise-free frames");
  app.add_option("--threads", options_.threads, "0: one per core; the result is the same")
      ->capture_default_str()
      ->check(CLI::Range(0, 64));
}

void CommandLine::AddPath(CLI::App& app) {
  const std::string group = "Path";
  auto* path = app.add_option("--path", options_.path_file,
                              "follow this file: EuRoC ground-truth csv, or TUM")
                   ->check(CLI::ExistingFile)
                   ->group(group);
  app.add_option("--generate", generate_, "make a path: a hand-held walk, or a drone's flight")
      ->check(CLI::IsMember({"walk", "flight"}))
      ->capture_default_str()
      ->excludes(path)
      ->group(group);
  app.add_option("--path-seed", options_.generated.seed, "of the generated path")
      ->capture_default_str()
      ->excludes(path)
      ->group(group);
  app.add_option("--static-start", options_.generated.static_start_s,
                 "seconds a generated path stands still first")
      ->capture_default_str()
      ->check(NotNegative())
      ->excludes(path)
      ->group(group);
  app.add_option("--start", options_.start_s, "seconds of the path to leave out")
      ->capture_default_str()
      ->check(NotNegative())
      ->group(group);
  app.add_option("--duration", options_.duration_s,
                 "seconds to record; default: a file's whole path, or 60")
      ->check(Positive())
      ->group(group);
  app.add_option("--knot-spacing", knot_spacing_s_,
                 "seconds between the spline's knots on positions (half of it: on rotations); "
                 "default 0.1 and 0.05, with --imu 0.05 and 0.02")
      ->check(Within(0.01, 1))
      ->group(group);
}

void CommandLine::AddScene(CLI::App& app) {
  const std::string group = "Scene";
  app.add_option("--scene", scene_,
                 "hall, room, one of two rooms that share a dozen identical objects, a hall with "
                 "hardly a mark in it, or one of two with the same machines in rows")
      ->check(CLI::IsMember(kScenes))
      ->capture_default_str()
      ->group(group);
  app.add_option("--scene-seed", options_.scene.seed, "changes everything in the scene")
      ->capture_default_str()
      ->group(group);
  auto* tags =
      app.add_option("--tags", first_tag_,
                     "AprilTags (36h11) every 1.5 m along the walls, with ids from this on")
          ->check(CLI::Range(0, NumTagIds(TagFamily::k36h11) - 1))
          ->group(group);
  app.add_option("--tag-size", tag_size_m_, "side of their black square, m")
      ->check(Within(0.02, 2))
      ->capture_default_str()
      ->needs(tags)
      ->group(group);
  app.add_option("--keep-clear", options_.keep_clear_files,
                 "further paths the scene must hold and stay clear of. A scene is built around "
                 "--path and these, so recordings of one scene need the same set, in any order")
      ->check(CLI::ExistingFile)
      ->group(group);
}

void CommandLine::AddSensors(CLI::App& app) {
  const std::string group = "Sensors";
  app.add_option("--camera", camera_,
                 "EuRoC's cam0, a phone (fisheye lens, rolling shutter), or TUM-VI's wide fisheye")
      ->check(CLI::IsMember({"euroc", "phone", "wide"}))
      ->capture_default_str()
      ->group(group);
  app.add_option("--shrink", shrink_, "divide the image's size by this")
      ->check(Within(1, 8))
      ->capture_default_str()
      ->group(group);
  app.add_option("--image-rate", options_.image_rate_hz, "Hz")
      ->check(Within(1, 100))
      ->capture_default_str()
      ->group(group);
  app.add_option("--exposure-ms", exposure_ms_, "motion blur; EuRoC's dark flights: 8")
      ->check(Within(0, 30))
      ->capture_default_str()
      ->group(group);
  app.add_option("--brightness", options_.sensor.brightness,
                 "of the pictures; EuRoC's dark flights: 0.35")
      ->check(Within(0.05, 2))
      ->capture_default_str()
      ->group(group);
  auto* imu = app.add_option("--imu", options_.imu_file,
                             "put this recorded IMU (EuRoC csv) beside the rendered images")
                  ->check(CLI::ExistingFile)
                  ->group(group);
  auto* stamps = app.add_option("--stamps", options_.stamps_file,
                                "stamps of the images to render, ns, one a line (with --imu)")
                     ->check(CLI::ExistingFile)
                     ->needs(imu)
                     ->group(group);
  imu->needs(stamps);
  app.add_flag("--perfect", options_.perfect, "no noise, no blur, no exposure changes, no biases")
      ->group(group);
  app.add_flag("--tracks", options_.tracks,
               "write exact feature tracks to mav0/cam0/tracks.csv: stamp, landmark id, u, v")
      ->group(group);
}

void CommandLine::Apply() {
  options_.generated.motion = generate_ == "walk" ? Motion::kWalk : Motion::kFlight;
  if (options_.path_file.empty()) {
    constexpr double kDefaultDuration = 60;
    const double duration = options_.duration_s > 0 ? options_.duration_s : kDefaultDuration;
    constexpr double kMargins = 0.21;
    options_.generated.duration_s = options_.start_s + duration + kMargins;
  }
  options_.scene.kind = kScenes.at(scene_);
  if (first_tag_) {
    options_.scene.tags = {.first_id = *first_tag_, .size_m = tag_size_m_};
  }
  options_.camera = CameraOf(camera_);
  if (shrink_ > 1) {
    options_.camera = Shrunk(options_.camera, shrink_);
  }
  // A recorded IMU must fit the images: the path must follow its rotations up to about 25 Hz.
  options_.spline = options_.imu_file.empty() ? SplinePathOptions{} : SplinePathOptions{0.05, 0.02};
  if (knot_spacing_s_ > 0) {
    options_.spline = {knot_spacing_s_, 0.5 * knot_spacing_s_};
  }
  options_.sensor.exposure_s = 1e-3 * exposure_ms_;
  if (no_cache_) {
    options_.cache_dir.clear();
  }
}

RecordingSummary CommandLine::Render() const {
  pangea::Progress progress("pangea-sim");
  return RenderRecording(options_, [&progress](size_t done, size_t all) {
    progress.Update(static_cast<int64_t>(done), static_cast<int64_t>(all), "frames");
  });
}

void CommandLine::Run() {
  Apply();
  const RecordingSummary summary = Render();
  fmt::print(
      "{}: {} frames ({} rendered, {} from the cache), {:.1f} m of path, at most {:.1f} m/s^2",
      options_.out, summary.images, summary.rendered, summary.images - summary.rendered,
      summary.path_m, summary.largest_acceleration);
  if (summary.steps_spread > 0) {
    fmt::print(", {} position steps spread", summary.steps_spread);
  }
  fmt::print("\n");
}

}  // namespace

int RunCommandLine(int argc, char** argv) {
  CLI::App app("Renders a visual-inertial recording in EuRoC's format, with exact ground truth",
               "pangea-sim");
  AddVersion(app);
  CommandLine command(app);
  CLI11_PARSE(app, argc, argv);
  try {
    command.Run();
  } catch (const std::exception& error) {
    return Failed("pangea-sim", error);
  }
  return 0;
}

}  // namespace pangea::sim
