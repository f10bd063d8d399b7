#include "messages/messages.h"

#include "messages/messages_checks.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace pangea {

using namespace messages_checks;

namespace {

constexpr size_t kMaxText = 500;
constexpr int16_t kMaxChunks = 2000;  // a million keyframes

}  // namespace

map_id_t ToMessage(const MapId& id) {
  map_id_t m{};
  m.agent_id = id.agent_id;
  m.opened_utime = id.opened_utime;
  return m;
}

keyframe_id_t ToMessage(const KeyframeId& id) {
  keyframe_id_t m{};
  m.map = ToMessage(id.map);
  m.seq = id.seq;
  return m;
}

vector3_t ToMessage(const Eigen::Vector3d& v) {
  vector3_t m{};
  m.x = v.x();
  m.y = v.y();
  m.z = v.z();
  return m;
}

rigid3_t ToMessage(const Rigid3& T) {
  rigid3_t m{};
  m.rotation.w = T.q.w();
  m.rotation.x = T.q.x();
  m.rotation.y = T.q.y();
  m.rotation.z = T.q.z();
  m.translation = ToMessage(T.t);
  return m;
}

camera_t ToMessage(const CameraModel& camera) {
  camera_t m{};
  m.model = camera.kind == CameraModel::Kind::kRadtan ? camera_t::MODEL_RADTAN
                                                      : camera_t::MODEL_EQUIDISTANT;
  m.width = camera.width;
  m.height = camera.height;
  m.fx = camera.fx;
  m.fy = camera.fy;
  m.cx = camera.cx;
  m.cy = camera.cy;
  Eigen::Vector4d::Map(m.distortion) = camera.distortion;
  m.T_body_cam = ToMessage(camera.T_body_cam);
  m.time_offset_s = camera.time_offset_s;
  m.readout_s = camera.readout_s;
  return m;
}

place_match_t ToMessage(const PlaceMatch& match) {
  place_match_t m{};
  m.query = ToMessage(match.query);
  for (const PlaceCandidate& candidate : match.candidates) {
    place_candidate_t c{};
    c.match = ToMessage(candidate.match);
    c.kind = static_cast<int8_t>(candidate.kind);
    c.score = candidate.score;
    c.num_matches = static_cast<int16_t>(candidate.corner_matches.size());
    for (const auto& [query, matched] : candidate.corner_matches) {
      c.query_corner.push_back(static_cast<int16_t>(query));
      c.match_corner.push_back(static_cast<int16_t>(matched));
    }
    m.candidates.push_back(c);
  }
  m.num_candidates = static_cast<int16_t>(m.candidates.size());
  m.rejected = match.rejected;
  m.num_rejected = static_cast<int16_t>(m.rejected.size());
  return m;
}

constraint_t ToMessage(const Constraint& constraint) {
  constraint_t m{};
  m.id = constraint.Id();
  m.from = ToMessage(constraint.from);
  m.to = ToMessage(constraint.to);
  m.kind = static_cast<int8_t>(constraint.kind);
  m.accepted = constraint.accepted;
  m.reason = constraint.reason;
  m.T_from_to = ToMessage(constraint.T_from_to);
  FromMatrix(constraint.covariance, m.covariance);
  m.num_inliers = constraint.num_inliers;
  m.inlier_ratio = static_cast<float>(constraint.inlier_ratio);
  m.rms_px = static_cast<float>(constraint.rms_px);
  return m;
}

correction_t ToMessage(const Correction& correction) {
  correction_t m{};
  m.map = ToMessage(correction.map);
  m.seq = correction.seq;
  m.group = ToMessage(correction.group);
  m.revision = correction.revision;
  m.T_map_odom = ToMessage(correction.T_map_odom);
  FromMatrix(correction.covariance, m.covariance);
  return m;
}

std::vector<map_state_t> ToMessages(const MapState& state) {
  constexpr size_t kChunk = 500;
  const size_t num_chunks = std::max<size_t>(1, (state.keyframes.size() + kChunk - 1) / kChunk);
  std::vector<map_state_t> messages;
  for (size_t chunk = 0; chunk < num_chunks; ++chunk) {
    map_state_t m{};
    m.group = ToMessage(state.group);
    m.revision = state.revision;
    m.chunk = static_cast<int16_t>(chunk);
    m.num_chunks = static_cast<int16_t>(num_chunks);
    for (const MapId& map : state.maps) {
      m.maps.push_back(ToMessage(map));
    }
    m.num_maps = static_cast<int16_t>(m.maps.size());
    m.num_constraints = state.num_constraints;
    m.num_switched_off = state.num_switched_off;
    const size_t end = std::min(state.keyframes.size(), (chunk + 1) * kChunk);
    for (size_t i = chunk * kChunk; i < end; ++i) {
      keyframe_pose_t pose{};
      pose.id = ToMessage(state.keyframes[i].id);
      pose.utime = state.keyframes[i].utime;
      pose.T_map_body = ToMessage(state.keyframes[i].T_map_body);
      m.keyframes.push_back(pose);
    }
    m.num_keyframes = static_cast<int16_t>(m.keyframes.size());
    messages.push_back(std::move(m));
  }
  return messages;
}

Parsed<MapId> Parse(const map_id_t& m) {
  if (m.agent_id < 1 || m.agent_id > 65535 || m.opened_utime < 0) {
    return Refused<MapId>(fmt::format("map id {}/{} out of range", m.agent_id, m.opened_utime));
  }
  return {MapId{m.agent_id, m.opened_utime}, ""};
}

Parsed<KeyframeId> Parse(const keyframe_id_t& m) {
  const auto map = Parse(m.map);
  if (!map.value) {
    return Refused<KeyframeId>(map.refused);
  }
  if (m.seq < 0 || m.seq > kMaxSeq) {
    return Refused<KeyframeId>("keyframe seq out of range");
  }
  return {KeyframeId{*map.value, m.seq}, ""};
}

Parsed<Rigid3> Parse(const rigid3_t& m) {
  const Eigen::Quaterniond q(m.rotation.w, m.rotation.x, m.rotation.y, m.rotation.z);
  const Eigen::Vector3d t = ToVector(m.translation);
  if (!(std::abs(q.norm() - 1) < 1e-3)) {
    return Refused<Rigid3>("quaternion is not of unit norm");
  }
  if (!Bounded(t, kMaxDistance)) {
    return Refused<Rigid3>("translation out of range");
  }
  return {Rigid3(q.normalized(), t), ""};
}

Parsed<CameraModel> Parse(const camera_t& m) {
  if (m.model != camera_t::MODEL_RADTAN && m.model != camera_t::MODEL_EQUIDISTANT) {
    return Refused<CameraModel>("unknown camera model");
  }
  const auto T_body_cam = Parse(m.T_body_cam);
  if (!T_body_cam.value) {
    return Refused<CameraModel>("T_body_cam: " + T_body_cam.refused);
  }
  CameraModel camera;
  camera.kind = m.model == camera_t::MODEL_RADTAN ? CameraModel::Kind::kRadtan
                                                  : CameraModel::Kind::kEquidistant;
  camera.width = m.width;
  camera.height = m.height;
  camera.fx = m.fx;
  camera.fy = m.fy;
  camera.cx = m.cx;
  camera.cy = m.cy;
  camera.distortion = Eigen::Vector4d::Map(m.distortion);
  camera.T_body_cam = *T_body_cam.value;
  camera.time_offset_s = m.time_offset_s;
  camera.readout_s = m.readout_s;
  if (const auto invalid = camera.Invalid()) {
    return Refused<CameraModel>("camera: " + *invalid);
  }
  return {camera, ""};
}

Parsed<PlaceMatch> Parse(const place_match_t& m) {
  const auto query = Parse(m.query);
  if (!query.value) {
    return Refused<PlaceMatch>(query.refused);
  }
  constexpr int kMaxCandidates = 100;
  if (m.num_candidates < 0 || m.num_candidates > kMaxCandidates) {
    return Refused<PlaceMatch>("too many candidates");
  }
  PlaceMatch match;
  match.query = *query.value;
  for (const place_candidate_t& c : m.candidates) {
    const auto matched = Parse(c.match);
    if (!matched.value || *matched.value == match.query) {
      return Refused<PlaceMatch>("candidate: invalid keyframe id");
    }
    if (c.kind != place_candidate_t::KIND_INTRA && c.kind != place_candidate_t::KIND_INTER &&
        c.kind != place_candidate_t::KIND_TAG) {
      return Refused<PlaceMatch>("candidate: unknown kind");
    }
    if (!std::isfinite(c.score) || c.num_matches < 0 || c.num_matches > kMaxCorners) {
      return Refused<PlaceMatch>("candidate: score or number of matches out of range");
    }
    PlaceCandidate candidate{*matched.value, static_cast<PlaceKind>(c.kind), c.score, {}};
    for (int i = 0; i < c.num_matches; ++i) {
      if (std::min(c.query_corner[i], c.match_corner[i]) < 0 ||
          std::max(c.query_corner[i], c.match_corner[i]) >= kMaxCorners) {
        return Refused<PlaceMatch>("candidate: corner index out of range");
      }
      candidate.corner_matches.emplace_back(c.query_corner[i], c.match_corner[i]);
    }
    match.candidates.push_back(std::move(candidate));
  }
  match.rejected = m.rejected;
  for (std::string& text : match.rejected) {
    text.resize(std::min(text.size(), kMaxText));
  }
  return {std::move(match), ""};
}

Parsed<Constraint> Parse(const constraint_t& m) {
  const auto from = Parse(m.from);
  const auto to = Parse(m.to);
  const auto T_from_to = Parse(m.T_from_to);
  const auto covariance = ToCovariance<6>(m.covariance);
  if (!from.value || !to.value || *from.value == *to.value) {
    return Refused<Constraint>("constraint: invalid keyframe ids");
  }
  if (m.kind != place_candidate_t::KIND_INTRA && m.kind != place_candidate_t::KIND_INTER &&
      m.kind != constraint_t::KIND_DERIVED && m.kind != place_candidate_t::KIND_TAG) {
    return Refused<Constraint>("constraint: unknown kind");
  }
  if (!T_from_to.value || !covariance) {
    return Refused<Constraint>("constraint: transform or covariance is invalid");
  }
  if (m.num_inliers < 0 || !std::isfinite(m.inlier_ratio) || !std::isfinite(m.rms_px)) {
    return Refused<Constraint>("constraint: inliers or error out of range");
  }
  Constraint constraint;
  constraint.from = *from.value;
  constraint.to = *to.value;
  constraint.kind = static_cast<PlaceKind>(m.kind);
  constraint.accepted = m.accepted != 0;
  constraint.reason = m.reason.substr(0, kMaxText);
  constraint.T_from_to = *T_from_to.value;
  constraint.covariance = *covariance;
  constraint.num_inliers = m.num_inliers;
  constraint.inlier_ratio = m.inlier_ratio;
  constraint.rms_px = m.rms_px;
  if (constraint.Id() != m.id) {
    return Refused<Constraint>("constraint: id does not follow from its keyframes");
  }
  return {std::move(constraint), ""};
}

Parsed<Correction> Parse(const correction_t& m) {
  const auto map = Parse(m.map);
  const auto group = Parse(m.group);
  const auto T_map_odom = Parse(m.T_map_odom);
  const auto covariance = ToCovariance<6>(m.covariance);
  if (!map.value || !group.value || m.seq < 0 || m.seq > kMaxSeq || m.revision < 1) {
    return Refused<Correction>("correction: invalid ids, seq or revision");
  }
  if (!T_map_odom.value || !covariance) {
    return Refused<Correction>("correction: transform or covariance is invalid");
  }
  return {Correction{*map.value, m.seq, *group.value, m.revision, *T_map_odom.value, *covariance},
          ""};
}

Parsed<ProcessOptions> Parse(const options_t& m) {
  constexpr size_t kMaxName = 50;
  constexpr size_t kMaxYaml = 16'000;
  const auto is_plain = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_';
  };
  if (m.process.empty() || m.process.size() > kMaxName ||
      !std::all_of(m.process.begin(), m.process.end(), is_plain)) {
    return Refused<ProcessOptions>("options: no name of a process");
  }
  if (m.yaml.size() > kMaxYaml) {
    return Refused<ProcessOptions>("options: too long");
  }
  return {ProcessOptions{m.process, m.utime, m.yaml}, ""};
}

Parsed<MapState> Parse(const map_state_t& m) {
  const auto group = Parse(m.group);
  if (!group.value || m.revision < 1 || m.chunk < 0 || m.num_chunks > kMaxChunks ||
      m.chunk >= m.num_chunks) {
    return Refused<MapState>("map state: invalid group, revision or chunk");
  }
  MapState state;
  state.group = *group.value;
  state.revision = m.revision;
  state.num_constraints = m.num_constraints;
  state.num_switched_off = m.num_switched_off;
  for (const map_id_t& map : m.maps) {
    const auto parsed = Parse(map);
    if (!parsed.value) {
      return Refused<MapState>("map state: " + parsed.refused);
    }
    state.maps.push_back(*parsed.value);
  }
  for (const keyframe_pose_t& pose : m.keyframes) {
    const auto id = Parse(pose.id);
    const auto T_map_body = Parse(pose.T_map_body);
    if (!id.value || !T_map_body.value) {
      return Refused<MapState>("map state: invalid keyframe pose");
    }
    state.keyframes.push_back({*id.value, pose.utime, *T_map_body.value});
  }
  return {std::move(state), ""};
}

}  // namespace pangea
