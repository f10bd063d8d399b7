#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <set>

#include "messages/messages.h"
#include "messages/messages_checks.h"

namespace pangea {

using namespace messages_checks;

namespace {

constexpr double kPixelScale = 16.0;
// The largest entry is d(position)/d(accelerometer bias), half the duration squared; after an hour
// this is 6.5e6 s^2.
constexpr double kMaxBiasJacobian = 1e7;
// A step of utime. The information on the biases is inverse to the duration, so it must be finite.
constexpr double kMinDuration_s = 1e-6;

using Vector36 = Eigen::Matrix<double, 36, 1>;

preintegration_t ToMessage(const Preintegration& p) {
  preintegration_t m{};
  m.duration_s = p.duration_s;
  m.delta_rotation.w = p.delta_q.w();
  m.delta_rotation.x = p.delta_q.x();
  m.delta_rotation.y = p.delta_q.y();
  m.delta_rotation.z = p.delta_q.z();
  m.delta_velocity = pangea::ToMessage(p.delta_v);
  m.delta_position = pangea::ToMessage(p.delta_p);
  FromMatrix(p.covariance, m.covariance);
  FromMatrix(p.bias_jacobian, m.bias_jacobian);
  m.gyro_bias = pangea::ToMessage(p.gyro_bias);
  m.accel_bias = pangea::ToMessage(p.accel_bias);
  return m;
}

Parsed<Preintegration> Parse(const preintegration_t& m) {
  Preintegration p;
  p.duration_s = m.duration_s;
  p.delta_q = Eigen::Quaterniond(m.delta_rotation.w, m.delta_rotation.x, m.delta_rotation.y,
                                 m.delta_rotation.z);
  p.delta_v = ToVector(m.delta_velocity);
  p.delta_p = ToVector(m.delta_position);
  p.bias_jacobian = Eigen::Map<const Eigen::Matrix<double, 9, 6, Eigen::RowMajor>>(m.bias_jacobian);
  p.gyro_bias = ToVector(m.gyro_bias);
  p.accel_bias = ToVector(m.accel_bias);
  const auto covariance = ToCovariance<9>(m.covariance);
  if (!(p.duration_s >= kMinDuration_s && p.duration_s < 3600) ||
      !(std::abs(p.delta_q.norm() - 1) < 1e-3) || !Bounded(p.delta_v, kMaxDistance) ||
      !Bounded(p.delta_p, kMaxDistance) || !p.bias_jacobian.allFinite() ||
      p.bias_jacobian.cwiseAbs().maxCoeff() > kMaxBiasJacobian || !Bounded(p.gyro_bias, 10) ||
      !Bounded(p.accel_bias, 100) || !covariance) {
    return Refused<Preintegration>("preintegration out of range");
  }
  p.delta_q.normalize();
  p.covariance = *covariance;
  return {p, ""};
}

using DescriptorBytes = decltype(keyframe_t::num_descriptor_bytes);
static_assert(kMaxCorners * sizeof(Descriptor) <= std::numeric_limits<DescriptorBytes>::max());

void PackCorners(const Keyframe& keyframe, keyframe_t* m) {
  m->num_corners = static_cast<int16_t>(keyframe.corners.size());
  m->descriptors.resize(keyframe.corners.size() * sizeof(Descriptor));
  m->num_descriptor_bytes = static_cast<DescriptorBytes>(m->descriptors.size());
  for (size_t i = 0; i < keyframe.corners.size(); ++i) {
    const Corner& corner = keyframe.corners[i];
    m->u_16th_px.push_back(static_cast<int16_t>(std::lround(corner.pixel.x() * kPixelScale)));
    m->v_16th_px.push_back(static_cast<int16_t>(std::lround(corner.pixel.y() * kPixelScale)));
    m->octave.push_back(corner.octave);
    std::memcpy(m->descriptors.data() + i * sizeof(Descriptor), corner.descriptor.data(),
                sizeof(Descriptor));
    if (corner.landmark_id != kNoLandmark) {
      m->tracked_corner.push_back(static_cast<int16_t>(i));
      m->landmark_id.push_back(corner.landmark_id);
    }
  }
  m->num_tracked = static_cast<int16_t>(m->tracked_corner.size());
}

// Returns why the corners are refused, or an empty string.
std::string UnpackCorners(const KeyframeMessage& m, Keyframe* keyframe) {
  if (m.num_corners < 0 || m.num_corners > kMaxCorners) {
    return fmt::format("num_corners {} out of 0 to {}", m.num_corners, kMaxCorners);
  }
  if (m.num_descriptor_bytes != m.num_corners * static_cast<int>(sizeof(Descriptor))) {
    return "descriptor bytes do not match the corners";
  }
  if (m.descriptor_kind < 0 || m.descriptor_kind >= kNumDescriptorKinds) {
    return fmt::format("descriptor_kind {} is unknown to this version, which knows 0 to {}",
                       m.descriptor_kind, kNumDescriptorKinds - 1);
  }
  keyframe->descriptor_kind = static_cast<DescriptorKind>(m.descriptor_kind);
  keyframe->corners.resize(m.num_corners);
  for (int i = 0; i < m.num_corners; ++i) {
    Corner& corner = keyframe->corners[i];
    corner.pixel = Eigen::Vector2f(m.u_16th_px[i], m.v_16th_px[i]) / kPixelScale;
    corner.octave = m.octave[i];
    if (!keyframe->camera.Contains(corner.pixel.cast<double>(), -1.0)) {
      return "corner outside the image";
    }
    if (corner.octave < 0 || corner.octave >= kNumOctaves) {
      return "octave out of range";
    }
    std::memcpy(corner.descriptor.data(), m.descriptors.data() + i * sizeof(Descriptor),
                sizeof(Descriptor));
  }
  for (int i = 0; i < m.num_tracked; ++i) {
    if (m.tracked_corner[i] < 0 || m.tracked_corner[i] >= m.num_corners || m.landmark_id[i] < 0) {
      return "tracked corner out of range";
    }
    keyframe->corners[m.tracked_corner[i]].landmark_id = m.landmark_id[i];
  }
  return "";
}

std::string UnpackPoints(const KeyframeMessage& m, Keyframe* keyframe) {
  if (m.num_points < 0 || m.num_points > m.num_corners) {
    return "more points than corners";
  }
  for (int i = 0; i < m.num_points; ++i) {
    MapPoint point{m.point_corner[i], m.inverse_depth[i], m.inverse_depth_variance[i]};
    if (point.corner < 0 || point.corner >= m.num_corners) {
      return "point's corner out of range";
    }
    if (!(point.inverse_depth > 1e-5f && point.inverse_depth < 1e3f) ||
        !(point.inverse_depth_var > 0 && point.inverse_depth_var < 1e6f)) {
      return "inverse depth out of range";
    }
    keyframe->points.push_back(point);
  }
  return "";
}

// Four pixels of a square that is seen from its front, far enough from a line.
bool IsTagOutline(const TagObservation& seen) {
  constexpr double kMinArea_px2 = 16;
  double area = 0;  // by the shoelace formula; y points down
  for (int i = 0; i < kTagCorners; ++i) {
    const Eigen::Vector2d a = seen.corners[i].cast<double>();
    const Eigen::Vector2d b = seen.corners[(i + 1) % kTagCorners].cast<double>();
    area += 0.5 * (b.x() * a.y() - a.x() * b.y());
  }
  return area >= kMinArea_px2;
}

std::string UnpackTags(const KeyframeMessage& m, Keyframe* keyframe) {
  if (m.tags.size() > kMaxTags) {
    return fmt::format("num_tags {} out of 1 to {}", m.tags.size(), kMaxTags);
  }
  std::set<TagId> known;
  for (const tag_t& tag : m.tags) {
    const auto family = TagFamilyOf(tag.family);
    if (!family || tag.id < 0 || tag.id >= NumTagIds(*family)) {
      return fmt::format("a tag of family {} with id {} is unknown to this version", tag.family,
                         tag.id);
    }
    TagObservation seen{{*family, tag.id}, {}};
    for (int i = 0; i < kTagCorners; ++i) {
      seen.corners[i] = {tag.u_px[i], tag.v_px[i]};
      if (!keyframe->camera.Contains(seen.corners[i].cast<double>(), -1.0)) {
        return "a tag's corner is outside the image";
      }
    }
    if (!IsTagOutline(seen) || !known.insert(seen.tag).second) {
      return "a tag is no square seen from its front, or is there twice";
    }
    keyframe->tags.push_back(seen);
  }
  return "";
}

std::string UnpackEdge(const KeyframeMessage& m, Keyframe* keyframe) {
  if (m.has_edge) {
    const auto T = pangea::Parse(m.T_from_this);
    const auto covariance = ToCovariance<6>(m.edge_covariance);
    if (!T.value || !covariance) {
      return "odometry edge's transform or covariance is invalid";
    }
    if (m.edge_from_seq < 0 || m.edge_from_seq >= m.id.seq) {
      return "odometry edge does not begin at an earlier keyframe";
    }
    keyframe->edge = OdometryEdge{m.edge_from_seq, *T.value, *covariance};
  }
  if (m.has_preintegration) {
    const auto preintegration = Parse(m.preintegration);
    if (!preintegration.value) {
      return preintegration.refused;
    }
    keyframe->preintegration = preintegration.value;
  }
  return "";
}

std::string UnpackCommonErrors(const KeyframeMessage& m, Keyframe* keyframe) {
  if (!(m.scale_sigma >= 0 && m.scale_sigma <= kMaxScaleSigma)) {
    return "scale's sigma out of range";
  }
  keyframe->scale_sigma = m.scale_sigma;
  const Eigen::Map<const Vector36> covariance(m.T_body_cam_covariance);
  if (covariance.isZero(0)) {
    return "";
  }
  const auto positive = ToCovariance<6>(m.T_body_cam_covariance);
  keyframe->T_body_cam_covariance = positive.value_or(Matrix6d::Zero());
  return positive ? "" : "covariance of the extrinsics is invalid";
}

}  // namespace

KeyframeMessage ToMessage(const Keyframe& keyframe) {
  KeyframeMessage m{};
  m.id = ToMessage(keyframe.id);
  m.utime = keyframe.utime;
  m.camera = ToMessage(keyframe.camera);
  m.T_odom_body = ToMessage(keyframe.T_odom_body);
  m.v_odom_body = ToMessage(keyframe.v_odom_body);
  m.gyro_bias = ToMessage(keyframe.gyro_bias);
  m.accel_bias = ToMessage(keyframe.accel_bias);
  FromMatrix(keyframe.roll_pitch_covariance, m.roll_pitch_covariance);
  m.has_edge = keyframe.edge.has_value();
  if (keyframe.edge) {
    m.edge_from_seq = keyframe.edge->from_seq;
    m.T_from_this = ToMessage(keyframe.edge->T_from_this);
    FromMatrix(keyframe.edge->covariance, m.edge_covariance);
  }
  m.has_preintegration = keyframe.preintegration.has_value();
  if (keyframe.preintegration) {
    m.preintegration = ToMessage(*keyframe.preintegration);
  }
  PackCorners(keyframe, &m);
  for (const MapPoint& point : keyframe.points) {
    m.point_corner.push_back(static_cast<int16_t>(point.corner));
    m.inverse_depth.push_back(point.inverse_depth);
    m.inverse_depth_variance.push_back(point.inverse_depth_var);
  }
  m.num_points = static_cast<int16_t>(keyframe.points.size());
  m.group_revision = keyframe.group_revision;
  m.scale_sigma = keyframe.scale_sigma;
  m.descriptor_kind = static_cast<int8_t>(keyframe.descriptor_kind);
  FromMatrix(keyframe.T_body_cam_covariance, m.T_body_cam_covariance);
  for (const TagObservation& seen : keyframe.tags) {
    tag_t& tag = m.tags.emplace_back();
    tag.family = static_cast<int8_t>(seen.tag.family);
    tag.id = seen.tag.id;
    for (int i = 0; i < kTagCorners; ++i) {
      tag.u_px[i] = seen.corners[i].x();
      tag.v_px[i] = seen.corners[i].y();
    }
  }
  return m;
}

Parsed<Keyframe> Parse(const KeyframeMessage& m) {
  const auto id = Parse(m.id);
  const auto camera = Parse(m.camera);
  const auto T_odom_body = Parse(m.T_odom_body);
  if (!id.value) {
    return Refused<Keyframe>(id.refused);
  }
  if (!camera.value) {
    return Refused<Keyframe>(camera.refused);
  }
  if (!T_odom_body.value) {
    return Refused<Keyframe>("T_odom_body: " + T_odom_body.refused);
  }
  Keyframe keyframe;
  keyframe.id = *id.value;
  keyframe.utime = m.utime;
  keyframe.camera = *camera.value;
  keyframe.T_odom_body = *T_odom_body.value;
  keyframe.v_odom_body = ToVector(m.v_odom_body);
  keyframe.gyro_bias = ToVector(m.gyro_bias);
  keyframe.accel_bias = ToVector(m.accel_bias);
  keyframe.group_revision = m.group_revision;
  if (m.utime < 0 || m.utime > kMaxUtime) {
    return Refused<Keyframe>("time out of range: is it in microseconds?");
  }
  if (!Bounded(keyframe.v_odom_body, 1000) || !Bounded(keyframe.gyro_bias, 10) ||
      !Bounded(keyframe.accel_bias, 100)) {
    return Refused<Keyframe>("velocity or biases out of range");
  }
  const auto roll_pitch = ToCovariance<2>(m.roll_pitch_covariance);
  if (!roll_pitch) {
    return Refused<Keyframe>("roll/pitch covariance is not positive definite");
  }
  keyframe.roll_pitch_covariance = *roll_pitch;
  if (std::string reason = UnpackCommonErrors(m, &keyframe); !reason.empty()) {
    return Refused<Keyframe>(std::move(reason));
  }
  for (const auto& unpack : {UnpackEdge, UnpackCorners, UnpackPoints, UnpackTags}) {
    if (std::string reason = unpack(m, &keyframe); !reason.empty()) {
      return Refused<Keyframe>(std::move(reason));
    }
  }
  return {std::move(keyframe), ""};
}

}  // namespace pangea
