#include "anchors/odometry_track.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>

#include "core/byte_record.h"

namespace pangea {
namespace {

constexpr size_t kPointBytes = sizeof(int32_t) + 4 * sizeof(float);

bool SameCamera(const CameraModel& a, const CameraModel& b) {
  return a.kind == b.kind && a.width == b.width && a.height == b.height && a.fx == b.fx &&
         a.fy == b.fy && a.cx == b.cx && a.cy == b.cy && a.distortion == b.distortion &&
         a.T_body_cam.q.coeffs() == b.T_body_cam.q.coeffs() && a.T_body_cam.t == b.T_body_cam.t;
}

std::vector<uint8_t> EncodedPoints(const Keyframe& keyframe) {
  ByteRecordWriter writer;
  writer.Reserve(keyframe.points.size() * kPointBytes);
  for (const MapPoint& point : keyframe.points) {
    if (const auto p_cam = PointInCamera(keyframe, point)) {
      writer.Put(keyframe.corners[point.corner].landmark_id);
      writer.Put(Eigen::Vector3f(p_cam->cast<float>()));
      writer.Put(static_cast<float>(std::sqrt(point.inverse_depth_var) / point.inverse_depth));
    }
  }
  return writer.Take();
}

}  // namespace

void OdometryTrack::Add(const Keyframe& keyframe) {
  TrackedKeyframe tracked(Record(EncodedPoints(keyframe), records_));
  counters_.in_memory += tracked.points.in_memory() ? 1 : 0;
  tracked.utime = keyframe.utime;
  tracked.T_odom_body = keyframe.T_odom_body;
  tracked.v_odom_body = keyframe.v_odom_body;
  constexpr double kUnknown = std::numeric_limits<double>::infinity();
  tracked.edge_position_variance_m2 =
      keyframe.edge ? keyframe.edge->covariance.topLeftCorner<3, 3>().trace() / 3 : kUnknown;
  tracked.edge_rotation_variance_rad2 =
      keyframe.edge ? keyframe.edge->covariance.bottomRightCorner<3, 3>().trace() / 3 : kUnknown;
  tracked.camera =
      !keyframes_.empty() && SameCamera(*keyframes_.rbegin()->second.camera, keyframe.camera)
          ? keyframes_.rbegin()->second.camera
          : std::make_shared<const CameraModel>(keyframe.camera);
  keyframes_.emplace(keyframe.id.seq, std::move(tracked));
}

std::vector<TrackedPoint> OdometryTrack::Points(const TrackedKeyframe& keyframe) const {
  const auto bytes = keyframe.points.Bytes(records_);
  if (!bytes) {
    ++counters_.unreadable;
    return {};
  }
  std::vector<TrackedPoint> points(bytes->size() / kPointBytes);
  ByteRecordReader reader(*bytes);
  for (TrackedPoint& point : points) {
    reader.Get(&point.landmark_id);
    reader.Get(&point.p_cam);
    reader.Get(&point.relative_depth_sigma);
  }
  return points;
}

const TrackedKeyframe* OdometryTrack::Find(int32_t seq) const {
  const auto found = keyframes_.find(seq);
  return found == keyframes_.end() ? nullptr : &found->second;
}

OdometryTrack::Keyframes::const_iterator OdometryTrack::Nearest(int64_t utime) const {
  return std::ranges::min_element(
      keyframes_, {}, [utime](const auto& item) { return std::abs(item.second.utime - utime); });
}

std::optional<Rigid3> OdometryTrack::Between(int64_t utime) const {
  // Stamps ascend with seq.
  const auto after = std::ranges::find_if(
      keyframes_, [utime](const auto& item) { return item.second.utime >= utime; });
  if (after == keyframes_.end()) {
    return std::nullopt;
  }
  const TrackedKeyframe& b = after->second;
  if (b.utime == utime) {
    return b.T_odom_body;
  }
  if (after == keyframes_.begin()) {
    return std::nullopt;
  }
  const TrackedKeyframe& a = std::prev(after)->second;
  const double duration_s = 1e-6 * static_cast<double>(b.utime - a.utime);
  const double s = 1e-6 * static_cast<double>(utime - a.utime) / duration_s;
  // Cubic Hermite basis.
  const double h10 = s * (1 - s) * (1 - s), h01 = s * s * (3 - 2 * s), h11 = s * s * (s - 1);
  const Eigen::Vector3d t = (1 - h01) * a.T_odom_body.t + h01 * b.T_odom_body.t +
                            duration_s * (h10 * a.v_odom_body + h11 * b.v_odom_body);
  return Rigid3(a.T_odom_body.q.slerp(s, b.T_odom_body.q), t);
}

std::pair<double, double> OdometryTrack::Drift(int32_t seq_a, int32_t seq_b) const {
  std::pair<double, double> variance{0, 0};
  const auto end = keyframes_.upper_bound(std::max(seq_a, seq_b));
  for (auto it = keyframes_.upper_bound(std::min(seq_a, seq_b)); it != end; ++it) {
    variance.first += it->second.edge_position_variance_m2;
    variance.second += it->second.edge_rotation_variance_rad2;
  }
  return variance;
}

}  // namespace pangea
