// Measures keyframe descriptions against a recording's ground truth: of the matches between two
// views more than 0.1 m apart, how many agree with one motion near the true one; by the angle
// between the views.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <ctime>
#include <iostream>

#include "core/matching.h"
#include "recording/euroc.h"
#include "vio/front_end/describer.h"
#include "vio/front_end/tracker.h"

namespace pangea::vio {
namespace {

constexpr int64_t kMaxGap_us = 20'000;

struct View {
  double time_s = 0;
  Rigid3 T_reference_cam;
  std::vector<Corner> corners;
};

struct Tally {
  int pairs = 0;
  double matches = 0;
  double correct = 0;
  void Print(const char* name) const {
    fmt::print("{}: {} pairs, {:.1f} matches a pair, {:.3f} of them agree with one motion\n", name,
               pairs, matches / std::max(1, pairs), correct / std::max(1.0, matches));
  }
};

// The number of matches that agree with one motion near the true one. On real recordings the true
// rotation is only known to about a degree, so it is the initial guess, refined by the matches.
int Consistent(const CameraModel& camera, const View& a, const View& b,
               const std::vector<CornerMatch>& matches) {
  std::vector<Eigen::Vector2d> rays_a, rays_b;
  for (const CornerMatch& match : matches) {
    const auto ray_a = camera.Unproject(a.corners[match.a].pixel.cast<double>());
    const auto ray_b = camera.Unproject(b.corners[match.b].pixel.cast<double>());
    if (ray_a && ray_b) {
      rays_a.push_back(*ray_a);
      rays_b.push_back(*ray_b);
    }
  }
  TwoViewOptions options;
  options.inlier_px = 3;
  options.rotation_sigma = 0.03;
  const Eigen::Quaterniond q_b_a = b.T_reference_cam.q.conjugate() * a.T_reference_cam.q;
  return CheckTwoView(rays_a, rays_b, q_b_a, camera.PixelAngle(), options).num_inliers;
}

struct Views {
  std::vector<View> views;
  double milliseconds = 0;
  double corners = 0;
};

// One view each `step_s` seconds, where the truth is known.
Views DescribeAll(const EurocRecording& recording, double step_s, bool landmarks,
                  const DescriberOptions& options) {
  const CameraModel& camera = recording.camera();
  Tracker tracker(camera, {});
  Describer describer(camera, options);
  Views all;
  for (size_t i = 0; i < recording.images().size(); ++i) {
    const EurocImage& entry = recording.images()[i];
    const double t = 1e-6 * static_cast<double>(entry.utime - recording.images().front().utime);
    std::string why;
    const auto T = Interpolate(recording.ground_truth(), entry.utime, kMaxGap_us);
    if ((!all.views.empty() && t < all.views.back().time_s + step_s) || !T) {
      continue;
    }
    const cv::Mat image = recording.LoadImage(i, &why);
    if (image.empty()) {
      std::cerr << fmt::format("{}\n", why);
      continue;
    }
    // New features stand for tracked ones, at the places where the tracker would put them.
    tracker.Reset();
    const TrackedFrame& frame = tracker.Track(entry.utime, image, Eigen::Quaterniond::Identity());
    const std::clock_t begin = std::clock();
    const Rigid3 T_reference_cam = *T * camera.T_body_cam;
    all.views.push_back(
        {t, T_reference_cam,
         describer.Describe(image, landmarks ? frame : TrackedFrame{},
                            -(T_reference_cam.q.conjugate() * Eigen::Vector3d::UnitZ()))});
    all.milliseconds += 1e3 * static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
    all.corners += static_cast<double>(all.views.back().corners.size());
  }
  return all;
}

struct Tallies {
  Tally slight, rotated, unlike;

  // The tally that counts two views; null if none does.
  Tally* Of(const View& a, const View& b) {
    constexpr double kDegree = 0.017453292519943295;
    const Rigid3 T_a_b = a.T_reference_cam.Inverse() * b.T_reference_cam;
    const double angle = T_a_b.q.angularDistance(Eigen::Quaterniond::Identity());
    if (T_a_b.t.norm() < 0.1) {
      return nullptr;  // too short a baseline for an epipolar line
    }
    if (angle < 25 * kDegree) {
      return angle < 12 * kDegree ? &slight : &rotated;
    }
    return angle > 103 * kDegree ? &unlike : nullptr;
  }
};

Tallies MatchAll(const CameraModel& camera, const std::vector<View>& views, DescriptorKind kind) {
  constexpr int kMaxPairs = 1000;
  Tallies tallies;
  for (size_t i = 0; i < views.size(); ++i) {
    for (size_t j = i + 1; j < views.size(); ++j) {
      Tally* const tally = tallies.Of(views[i], views[j]);
      if (tally == nullptr || tally->pairs > kMaxPairs) {
        continue;
      }
      ++tally->pairs;
      const auto matches =
          MatchCorners(views[i].corners, views[j].corners, {.max_distance = LimitsOf(kind).alike});
      tally->matches += static_cast<double>(matches.size());
      tally->correct += Consistent(camera, views[i], views[j], matches);
    }
  }
  return tallies;
}

void Run(const std::string& folder, double step_s, bool landmarks,
         const DescriberOptions& options) {
  const EurocRecording recording(folder);
  const auto [views, milliseconds, corners] = DescribeAll(recording, step_s, landmarks, options);
  const auto n = static_cast<double>(views.size());
  fmt::print("{} views, {:.0f} corners each, {:.1f} ms each\n", views.size(), corners / n,
             milliseconds / n);
  const Tallies tallies = MatchAll(recording.camera(), views, options.descriptor);
  tallies.slight.Print("rotation of 0 to 12 degrees");
  tallies.rotated.Print("rotation of 12 to 25 degrees");
  tallies.unlike.Print("rotation of over 103 degrees");
}

}  // namespace
}  // namespace pangea::vio

int main(int argc, char** argv) {
  std::string recording;
  double step_s = 0.4;
  bool landmarks = true;
  bool orb = false;
  pangea::vio::DescriberOptions options;
  CLI::App app("Measures keyframe descriptions against ground truth", "pangea-vio-describer-bench");
  app.add_option("recording", recording)->required();
  app.add_option("--step", step_s, "seconds between views");
  app.add_option("--landmarks", landmarks, "0: no tracked landmarks, corners only");
  app.add_flag("--orb", orb, "in place of the network");
  app.add_option("--max-blobs", options.max_blobs);
  CLI11_PARSE(app, argc, argv);
  options.descriptor = orb ? pangea::DescriptorKind::kOrb : pangea::DescriptorKind::kPatchNetwork;
  cv::setNumThreads(1);
  try {
    pangea::vio::Run(recording, step_s, landmarks, options);
  } catch (const std::exception& error) {
    std::cerr << error.what() << "\n";
    return 1;
  }
  return 0;
}
