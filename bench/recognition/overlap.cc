#include "bench/recognition/overlap.h"

#include <cmath>
#include <numbers>

namespace pangea::bench {
namespace {

using Eigen::Vector3d;

const double kMinCosine = std::cos(std::numbers::pi / 4);
constexpr double kMaxDistanceRatio = 2;

bool Sees(const View& view, const Vector3d& p_reference, const Vector3d& eye_of_first) {
  const Vector3d first = p_reference - eye_of_first;
  const Vector3d second = p_reference - view.T_reference_cam.t;
  const double from_first = first.norm(), from_second = second.norm();
  if (from_second > kMaxDistanceRatio * from_first ||
      from_first > kMaxDistanceRatio * from_second ||
      first.dot(second) < kMinCosine * from_first * from_second) {
    return false;
  }
  const auto pixel = view.camera.Project(view.T_reference_cam.Inverse() * p_reference);
  return pixel && view.camera.Contains(*pixel);
}

double ShareSeen(const View& owner, const View& other) {
  if (owner.p_reference.empty()) {
    return 0;
  }
  int seen = 0;
  for (const Vector3d& p : owner.p_reference) {
    seen += Sees(other, p, owner.T_reference_cam.t) ? 1 : 0;
  }
  return static_cast<double>(seen) / static_cast<double>(owner.p_reference.size());
}

}  // namespace

View ViewOf(const Keyframe& keyframe, const Rigid3& T_reference_body) {
  View view{keyframe.camera, T_reference_body * keyframe.camera.T_body_cam, {}};
  for (const MapPoint& point : keyframe.points) {
    if (const auto p_cam = PointInCamera(keyframe, point)) {
      view.p_reference.push_back(view.T_reference_cam * *p_cam);
    }
  }
  return view;
}

double Overlap(const View& a, const View& b) { return 0.5 * (ShareSeen(a, b) + ShareSeen(b, a)); }

}  // namespace pangea::bench
