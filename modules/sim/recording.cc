#include "sim/recording.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <exception>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <thread>

#include "sim/euroc_writer.h"
#include "sim/imu_simulator.h"
#include "sim/random.h"
#include "sim/render/frame_cache.h"
#include "sim/render/renderer.h"
#include "sim/render/tracks.h"
#include "sim/schedule.h"

namespace pangea::sim {
namespace {

// Increment this whenever the same options give different noise-free frames.
constexpr uint64_t kRenderVersion = 1;

std::vector<Eigen::Vector3d> PointsOf(const Trajectory& trajectory) {
  std::vector<Eigen::Vector3d> points;
  for (const StampedPose& pose : trajectory) {
    points.push_back(pose.T.t);
  }
  return points;
}

template <typename T>
uint64_t HashValue(const T& value, uint64_t hash) {
  return HashBytes(&value, sizeof(value), hash);
}

// Hash of everything that a noise-free frame depends on, except its stamp.
uint64_t FrameKey(const SceneOptions& scene, const SplinePath& path, const CameraModel& camera,
                  const SensorOptions& sensor) {
  uint64_t hash = HashValue(kRenderVersion, path.Hash());
  for (const double value :
       {static_cast<double>(scene.kind), scene.clearance_m, scene.coarseness,
        static_cast<double>(camera.kind), camera.fx, camera.fy, camera.cx, camera.cy,
        camera.distortion[0], camera.distortion[1], camera.distortion[2], camera.distortion[3],
        camera.time_offset_s, camera.readout_s, sensor.exposure_s, sensor.vignetting}) {
    hash = HashValue(value, hash);
  }
  hash = HashValue(scene.seed, hash);
  hash = HashValue(camera.width, HashValue(camera.height, hash));
  for (int i = 0; i < 4; ++i) {
    hash = HashValue(camera.T_body_cam.q.coeffs()[i], hash);
  }
  for (int i = 0; i < 3; ++i) {
    hash = HashValue(camera.T_body_cam.t[i], hash);
  }
  for (const Eigen::Vector3d& point : scene.keep_clear) {
    hash = HashBytes(point.data(), 3 * sizeof(double), hash);
  }
  if (scene.tags) {
    for (const double value : {static_cast<double>(scene.tags->first_id), scene.tags->size_m,
                               scene.tags->every_m, scene.tags->height_m}) {
      hash = HashValue(value, hash);
    }
  }
  return hash;
}

// Exposure and read-out reach this far beyond a stamp.
constexpr int64_t kMarginNs = 100'000'000;

int64_t Nanoseconds(double seconds) { return std::llround(1e9 * seconds); }

Span SpanOf(const SplinePath& path, const RecordingOptions& options) {
  Span span{path.begin_ns() + kMarginNs, path.end_ns() - kMarginNs};
  span.begin_ns += Nanoseconds(options.start_s);
  if (options.duration_s > 0) {
    span.end_ns = std::min(span.end_ns, span.begin_ns + Nanoseconds(options.duration_s));
  }
  if (span.end_ns <= span.begin_ns) {
    throw std::runtime_error(fmt::format(
        "nothing to record: the path lasts {:.2f} s and the recording would start at {:.2f} s",
        1e-9 * static_cast<double>(path.end_ns() - path.begin_ns()), options.start_s));
  }
  return span;
}

// Runs one recording's parts in order.
class Recorder {
 public:
  explicit Recorder(const RecordingOptions& options);
  RecordingSummary Run(const Progress& progress);

 private:
  void WriteInertial();
  void WriteTracks() const;
  void WriteImages(const Progress& progress);
  cv::Mat NoiseFreeFrame(int64_t stamp_ns);
  void EnsureScene();
  Rigid3 CameraPose(int64_t stamp_ns, double row_delay_s) const;
  std::vector<Rigid3> RowPoses(int64_t stamp_ns) const;
  CameraRates RatesAt(int64_t stamp_ns) const;

  const RecordingOptions options_;
  RecordingSummary summary_;
  SceneOptions scene_options_;
  SensorOptions sensor_options_;
  std::optional<SplinePath> path_;
  Schedule schedule_;
  std::optional<RecordedImu> recorded_imu_;
  std::optional<Sensor> sensor_;
  std::optional<FrameCache> cache_;
  std::once_flag scene_once_;
  Scene scene_;
  std::optional<Renderer> renderer_;
  std::atomic<size_t> rendered_ = 0;
};

Recorder::Recorder(const RecordingOptions& options)
    : options_(options), scene_options_(options.scene), sensor_options_(options.sensor) {
  if (const auto invalid = options.camera.Invalid()) {
    throw std::runtime_error("camera: " + *invalid);
  }
  Trajectory trajectory;
  std::vector<std::string> warnings;
  if (options.path_file.empty()) {
    GeneratedPathOptions generated = options.generated;
    generated.scene = options.scene.kind;
    generated.q_body_cam = options.camera.T_body_cam.q;
    trajectory = GeneratePath(generated);
  } else {
    const Trajectory raw = ReadTrajectory(options.path_file, &warnings);
    summary_.steps_spread = FindSteps(raw, options.steps).size();
    trajectory = SpreadSteps(raw, options.steps);
    std::vector<std::string> files = options.keep_clear_files;
    files.push_back(options.path_file);
    // Sorted by hash, so that every recording of the scene uses the same points.
    std::vector<std::pair<uint64_t, std::vector<Eigen::Vector3d>>> sets;
    for (const std::string& file : files) {
      const auto points = PointsOf(ReadTrajectory(file, &warnings));
      sets.emplace_back(HashBytes(points.data(), points.size() * sizeof(points[0])), points);
    }
    std::ranges::sort(sets, {}, &decltype(sets)::value_type::first);
    const auto same = [](const auto& a, const auto& b) { return a.first == b.first; };
    sets.erase(std::unique(sets.begin(), sets.end(), same), sets.end());
    for (const auto& [hash, points] : sets) {
      scene_options_.keep_clear.insert(scene_options_.keep_clear.end(), points.begin(),
                                       points.end());
    }
  }
  path_.emplace(trajectory, options.spline);
  if (options.perfect) {
    sensor_options_.exposure_s = 0;
    sensor_options_.gain_variation = 0;
    sensor_options_.read_noise = 0;
    sensor_options_.shot_noise = 0;
  }
  const Span span = SpanOf(*path_, options);
  if (options.imu_file.empty()) {
    schedule_ = MakeSchedule(span, options.imu.rate_hz, options.image_rate_hz);
  } else {
    recorded_imu_ = ReadRecordedImu(options.imu_file);
    schedule_ = ReadSchedule(options.stamps_file, span, *recorded_imu_);
  }
  sensor_.emplace(options_.camera, sensor_options_);
  cache_.emplace(options.cache_dir,
                 FrameKey(scene_options_, *path_, options_.camera, sensor_options_));
}

void Recorder::EnsureScene() {
  std::call_once(scene_once_, [this] {
    scene_ = BuildScene(scene_options_);
    renderer_.emplace(scene_, options_.camera);
  });
}

Rigid3 Recorder::CameraPose(int64_t stamp_ns, double row_delay_s) const {
  const double since = 1e-9 * static_cast<double>(stamp_ns - path_->begin_ns());
  return path_->AtSeconds(since + options_.camera.time_offset_s + row_delay_s).T_ref_body *
         options_.camera.T_body_cam;
}

std::vector<Rigid3> Recorder::RowPoses(int64_t stamp_ns) const {
  if (options_.camera.readout_s == 0) {
    return {CameraPose(stamp_ns, 0)};
  }
  std::vector<Rigid3> poses;
  for (int y = 0; y < options_.camera.height; ++y) {
    poses.push_back(CameraPose(stamp_ns, options_.camera.RowTime_s(y)));
  }
  return poses;
}

CameraRates Recorder::RatesAt(int64_t stamp_ns) const {
  const double middle_row = 0.5 * options_.camera.readout_s;
  const PathState state =
      path_->AtSeconds(1e-9 * static_cast<double>(stamp_ns - path_->begin_ns()) +
                       options_.camera.time_offset_s + middle_row);
  const Rigid3& T_body_cam = options_.camera.T_body_cam;
  const Eigen::Vector3d v_body =
      state.T_ref_body.q.conjugate() * state.v_ref_body + state.omega_body.cross(T_body_cam.t);
  return {T_body_cam.q.conjugate() * state.omega_body, T_body_cam.q.conjugate() * v_body};
}

cv::Mat Recorder::NoiseFreeFrame(int64_t stamp_ns) {
  cv::Mat frame = cache_->Load(stamp_ns, {options_.camera.width, options_.camera.height});
  if (frame.empty()) {
    EnsureScene();
    frame = sensor_->NoiseFree(renderer_->Render(RowPoses(stamp_ns)), RatesAt(stamp_ns));
    cache_->Store(stamp_ns, frame);
    ++rendered_;
  }
  return frame;
}

void Recorder::WriteImages(const Progress& progress) {
  const EurocWriter writer = EurocWriter::Begun(options_.out);
  const std::vector<int64_t>& stamps = schedule_.images_ns;
  std::atomic<size_t> next = 0;
  std::mutex mutex;
  size_t done = 0;
  std::exception_ptr failure;
  const auto work = [&] {
    try {
      for (size_t i = next++; i < stamps.size(); i = next++) {
        const double time_s = 1e-9 * static_cast<double>(stamps[i] - stamps.front());
        const cv::Mat frame = NoiseFreeFrame(stamps[i]);
        writer.WriteImage(stamps[i], options_.perfect
                                         ? frame
                                         : sensor_->Develop(frame, options_.seed, time_s, i));
        const std::lock_guard lock(mutex);
        ++done;
        if (progress) {
          progress(done, stamps.size());
        }
      }
    } catch (...) {
      const std::lock_guard lock(mutex);
      failure = std::current_exception();
      next = stamps.size();
    }
  };
  const int threads = options_.threads > 0
                          ? options_.threads
                          : std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  std::vector<std::thread> helpers;
  for (int i = 1; i < threads; ++i) {
    helpers.emplace_back(work);
  }
  work();
  for (std::thread& helper : helpers) {
    helper.join();
  }
  if (failure) {
    std::rethrow_exception(failure);
  }
}

void Recorder::WriteInertial() {
  const EurocWriter writer(options_.out);
  writer.WriteBody("rendered by pangea-sim");
  writer.WriteCamera(options_.camera, options_.image_rate_hz, "rendered by pangea-sim");
  writer.WriteImuCalibration(options_.imu);
  writer.WriteImageList(schedule_.images_ns);
  if (!recorded_imu_) {
    const SimulatedImu imu = SimulateImu(*path_, schedule_.imu.begin_ns, schedule_.imu.end_ns,
                                         options_.imu, options_.perfect, options_.seed);
    writer.WriteImu(imu);
    writer.WriteGroundTruth(*path_, imu.stamps_ns, &imu);
    return;
  }
  writer.WriteText("imu0/data.csv", recorded_imu_->Text(schedule_.imu));
  writer.WriteGroundTruth(*path_, recorded_imu_->Stamps(schedule_.imu), nullptr);
}

void Recorder::WriteTracks() const {
  constexpr int kPoints = 150;
  TrackMaker tracks(scene_, options_.camera, kPoints, options_.scene.seed);
  std::string text = "#timestamp [ns],landmark_id,u [px],v [px]\n";
  for (const int64_t stamp : schedule_.images_ns) {
    for (const TrackedPoint& point : tracks.Next(RowPoses(stamp))) {
      text += fmt::format("{},{},{:.4f},{:.4f}\n", stamp, point.landmark_id, point.pixel.x(),
                          point.pixel.y());
    }
  }
  EurocWriter::Begun(options_.out).WriteText("cam0/tracks.csv", text);
}

RecordingSummary Recorder::Run(const Progress& progress) {
  WriteInertial();
  if (options_.tracks) {
    EnsureScene();
    WriteTracks();
  }
  WriteImages(progress);
  EurocWriter::Begun(options_.out).Finish();
  summary_.images = schedule_.images_ns.size();
  summary_.rendered = rendered_;
  Eigen::Vector3d previous = path_->At(schedule_.imu.begin_ns).T_ref_body.t;
  constexpr int64_t kStep = 5'000'000;
  for (int64_t t = schedule_.imu.begin_ns; t <= schedule_.imu.end_ns; t += kStep) {
    const PathState state = path_->At(t);
    summary_.path_m += (state.T_ref_body.t - previous).norm();
    previous = state.T_ref_body.t;
    summary_.largest_acceleration =
        std::max(summary_.largest_acceleration, state.a_ref_body.norm());
  }
  return summary_;
}

}  // namespace

RecordingSummary RenderRecording(const RecordingOptions& options, const Progress& progress) {
  return Recorder(options).Run(progress);
}

}  // namespace pangea::sim
