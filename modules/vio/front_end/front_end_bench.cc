// Measures the front end against a recording's ground truth: how long tracks live, how far they are
// from the geometry of one point seen from the true poses, and what an image costs.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <Eigen/Cholesky>
#include <algorithm>
#include <ctime>
#include <iostream>
#include <map>

#include "core/numerics/triangulation.h"
#include "recording/euroc.h"
#include "vio/front_end/tracker.h"

namespace pangea::vio {
namespace {

constexpr int64_t kMaxGap_us = 20'000;

struct View {
  Rigid3 T_cam_reference;
  Eigen::Vector2d ray;
};

double Percentile(std::vector<double> values, double share) {
  if (values.empty()) {
    return 0;
  }
  const size_t at = std::min(values.size() - 1, static_cast<size_t>(share * values.size()));
  std::nth_element(values.begin(), values.begin() + static_cast<ptrdiff_t>(at), values.end());
  return values[at];
}

// The point nearest to all rays, refined on the image plane with robust weights; residuals in
// units of the plane z = 1.
std::vector<double> Residuals(const std::vector<View>& views) {
  std::vector<LineOfSight> lines;
  for (const View& view : views) {
    const Rigid3 T_reference_cam = view.T_cam_reference.Inverse();
    lines.push_back({T_reference_cam.t, (T_reference_cam.q * view.ray.homogeneous()).normalized()});
  }
  const auto start = TriangulateMidpoint(lines);
  if (!start) {
    return {};
  }
  Eigen::Vector3d p = *start;
  Eigen::Matrix3d h;
  Eigen::Vector3d g;
  for (int iteration = 0; iteration < 10; ++iteration) {
    h.setZero();
    g.setZero();
    for (const View& view : views) {
      const Eigen::Vector3d c = view.T_cam_reference * p;
      if (c.z() < 0.05) {
        return {};
      }
      Eigen::Matrix<double, 2, 3> j;
      j << 1 / c.z(), 0, -c.x() / (c.z() * c.z()), 0, 1 / c.z(), -c.y() / (c.z() * c.z());
      const Eigen::Vector2d r = c.hnormalized() - view.ray;
      const Eigen::Matrix<double, 2, 3> jr = j * view.T_cam_reference.R();
      const double weight = 1.0 / (1.0 + r.squaredNorm() / 4e-6);
      h += weight * jr.transpose() * jr;
      g += weight * jr.transpose() * r;
    }
    p -= (h + 1e-12 * Eigen::Matrix3d::Identity()).ldlt().solve(g);
  }
  std::vector<double> residuals;
  for (const View& view : views) {
    const Eigen::Vector3d c = view.T_cam_reference * p;
    if (c.z() < 0.05) {
      return {};
    }
    residuals.push_back((c.hnormalized() - view.ray).norm());
  }
  return residuals;
}

// Rotation of the camera from the gyroscope between two image times.
Eigen::Quaterniond CameraRotation(const EurocRecording& recording, int64_t from, int64_t to,
                                  const Eigen::Vector3d& gyro_bias) {
  Eigen::Quaterniond q_from_to = Eigen::Quaterniond::Identity();
  int64_t at = from;
  for (const ImuSample& sample : recording.imu()) {
    if (sample.utime <= from) {
      continue;
    }
    const int64_t end = std::min(sample.utime, to);
    q_from_to =
        q_from_to * ExpSo3((sample.gyro - gyro_bias) * (1e-6 * static_cast<double>(end - at)));
    at = end;
    if (at >= to) {
      break;
    }
  }
  const Eigen::Quaterniond& q_body_cam = recording.camera().T_body_cam.q;
  return (q_body_cam.conjugate() * q_from_to.conjugate() * q_body_cam).normalized();
}

struct Options {
  std::string recording;
  double start = 0;
  double duration = 1e9;
  std::vector<double> gyro_bias = {0, 0, 0};
  double time_offset = 0;  // added to the images' time to look up the ground truth
  TrackerOptions tracker;
};

struct Tracked {
  std::map<int32_t, std::vector<View>> tracks;  // where ground truth is known
  std::vector<double> milliseconds, counts;     // of each image
  Tracker::Statistics sum;
};

void AddTo(Tracker::Statistics* sum, const Tracker::Statistics& image) {
  sum->tracked += image.tracked;
  sum->as_predicted += image.as_predicted;
  sum->lost_klt += image.lost_klt;
  sum->lost_backward += image.lost_backward;
  sum->lost_two_view += image.lost_two_view;
  sum->added += image.added;
}

Tracked TrackAll(const EurocRecording& recording, const Options& options) {
  const CameraModel& camera = recording.camera();
  Tracker tracker(camera, options.tracker);
  const Eigen::Vector3d bias(options.gyro_bias[0], options.gyro_bias[1], options.gyro_bias[2]);
  Tracked all;
  int64_t last = 0;
  for (size_t i = 0; i < recording.images().size(); ++i) {
    const EurocImage& entry = recording.images()[i];
    const double t = 1e-6 * static_cast<double>(entry.utime - recording.images().front().utime);
    if (t < options.start || t > options.start + options.duration) {
      continue;
    }
    std::string why;
    const cv::Mat image = recording.LoadImage(i, &why);
    if (image.empty()) {
      std::cerr << fmt::format("{}\n", why);
      continue;
    }
    const Eigen::Quaterniond q = last == 0 ? Eigen::Quaterniond::Identity()
                                           : CameraRotation(recording, last, entry.utime, bias);
    last = entry.utime;
    const std::clock_t begin = std::clock();
    const TrackedFrame& frame = tracker.Track(entry.utime, image, q);
    all.milliseconds.push_back(1e3 * static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC);
    all.counts.push_back(static_cast<double>(frame.observations.size()));
    AddTo(&all.sum, tracker.statistics());
    const auto T_reference_body =
        Interpolate(recording.ground_truth(),
                    entry.utime + static_cast<int64_t>(1e6 * options.time_offset), kMaxGap_us);
    if (!T_reference_body) {
      continue;
    }
    const Rigid3 T_cam_reference = (*T_reference_body * camera.T_body_cam).Inverse();
    for (const Observation& observation : frame.observations) {
      all.tracks[observation.landmark_id].push_back({T_cam_reference, observation.ray});
    }
  }
  return all;
}

struct TrackErrors {
  std::vector<double> residuals_px;
  int bad = 0, measured = 0;
};

// Like the estimator's window: at most 20 views at a time.
TrackErrors ErrorsOf(const std::map<int32_t, std::vector<View>>& tracks, double pixel_angle) {
  constexpr size_t kMinViews = 5, kMaxViews = 20;
  TrackErrors errors;
  for (const auto& [id, views] : tracks) {
    for (size_t begin = 0; begin + kMinViews <= views.size(); begin += kMaxViews) {
      const size_t end = std::min(begin + kMaxViews, views.size());
      const std::vector<double> r = Residuals({views.begin() + static_cast<ptrdiff_t>(begin),
                                               views.begin() + static_cast<ptrdiff_t>(end)});
      ++errors.measured;
      errors.bad += r.empty() || Percentile(r, 0.5) > 2.0 * pixel_angle ? 1 : 0;
      for (const double value : r) {
        errors.residuals_px.push_back(value / pixel_angle);
      }
    }
  }
  return errors;
}

void PrintTracking(const Tracked& all) {
  const double images = static_cast<double>(all.counts.size());
  const Tracker::Statistics& sum = all.sum;
  fmt::print(
      "frames {:.0f}  features median {:.0f} p5 {:.0f}  ms median {:.1f} p95 {:.1f}\n"
      "per frame: tracked {:.1f} as-predicted {:.1f} klt-lost {:.2f} backward-lost {:.2f} "
      "two-view-lost {:.2f} added {:.2f}\n",
      images, Percentile(all.counts, 0.5), Percentile(all.counts, 0.05),
      Percentile(all.milliseconds, 0.5), Percentile(all.milliseconds, 0.95), sum.tracked / images,
      sum.as_predicted / images, sum.lost_klt / images, sum.lost_backward / images,
      sum.lost_two_view / images, sum.added / images);
}

void PrintTracks(const Tracked& all, const TrackErrors& errors) {
  double observations = 0, squares = 0, long_ones = 0;
  for (const auto& [id, views] : all.tracks) {
    const double length = static_cast<double>(views.size());
    observations += length;
    squares += length * length;
    long_ones += length >= 5 ? 1 : 0;
  }
  const double tracks = static_cast<double>(all.tracks.size());
  const std::vector<double>& px = errors.residuals_px;
  fmt::print(
      "track length: mean {:.1f}, seen by an observation {:.1f}, >= 5 frames {:.2f}\n"
      "residual px (20-view windows): median {:.3f} p68 {:.3f} p90 {:.3f} p95 {:.3f} p99 {:.3f}  "
      "bad tracks {:.4f} of {}\n",
      observations / tracks, squares / observations, long_ones / tracks, Percentile(px, 0.5),
      Percentile(px, 0.68), Percentile(px, 0.9), Percentile(px, 0.95), Percentile(px, 0.99),
      static_cast<double>(errors.bad) / std::max(1, errors.measured), errors.measured);
}

void Run(const Options& options) {
  const EurocRecording recording(options.recording);
  const Tracked all = TrackAll(recording, options);
  PrintTracking(all);
  PrintTracks(all, ErrorsOf(all.tracks, recording.camera().PixelAngle()));
}

}  // namespace
}  // namespace pangea::vio

int main(int argc, char** argv) {
  pangea::vio::Options options;
  CLI::App app("Measures tracks against a recording's ground truth", "pangea-vio-front-end-bench");
  app.add_option("recording", options.recording)->required();
  app.add_option("--start", options.start, "seconds");
  app.add_option("--duration", options.duration, "seconds");
  app.add_option("--gyro-bias", options.gyro_bias)->expected(3);
  app.add_option("--time-offset", options.time_offset, "seconds");
  app.add_option("--features", options.tracker.max_features);
  app.add_option("--distance", options.tracker.min_distance_px);
  app.add_option("--inlier", options.tracker.two_view.inlier_px);
  CLI11_PARSE(app, argc, argv);
  cv::setNumThreads(1);
  try {
    pangea::vio::Run(options);
  } catch (const std::exception& error) {
    std::cerr << error.what() << "\n";
    return 1;
  }
  return 0;
}
