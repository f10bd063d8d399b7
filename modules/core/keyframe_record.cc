#include "core/keyframe_record.h"

namespace pangea {
namespace {

constexpr size_t kCornerBytes =
    2 * sizeof(float) + sizeof(int8_t) + sizeof(Descriptor) + sizeof(int32_t);
constexpr size_t kPointBytes = sizeof(int) + 2 * sizeof(float);
constexpr size_t kOtherBytes = 3000;  // upper bound of all but the corners and points

// Calls `visit(&part)` for each part that every keyframe has, except corners and points. Writing
// and reading share this list.
template <typename KeyframeType, typename Visit>
void VisitHead(KeyframeType& k, const Visit& visit) {
  visit(&k.id.map.agent_id);
  visit(&k.id.map.opened_utime);
  visit(&k.id.seq);
  visit(&k.utime);
  visit(&k.camera.kind);
  visit(&k.camera.width);
  visit(&k.camera.height);
  visit(&k.camera.fx);
  visit(&k.camera.fy);
  visit(&k.camera.cx);
  visit(&k.camera.cy);
  visit(&k.camera.distortion);
  visit(&k.camera.T_body_cam);
  visit(&k.camera.time_offset_s);
  visit(&k.camera.readout_s);
  visit(&k.T_odom_body);
  visit(&k.v_odom_body);
  visit(&k.gyro_bias);
  visit(&k.accel_bias);
  visit(&k.roll_pitch_covariance);
  visit(&k.group_revision);
  visit(&k.scale_sigma);
  visit(&k.descriptor_kind);
  visit(&k.T_body_cam_covariance);
}

template <typename EdgeType, typename Visit>
void VisitEdge(EdgeType& edge, const Visit& visit) {
  visit(&edge.from_seq);
  visit(&edge.T_from_this);
  visit(&edge.covariance);
}

template <typename PreintegrationType, typename Visit>
void VisitPreintegration(PreintegrationType& p, const Visit& visit) {
  visit(&p.duration_s);
  visit(&p.delta_q);
  visit(&p.delta_v);
  visit(&p.delta_p);
  visit(&p.covariance);
  visit(&p.bias_jacobian);
  visit(&p.gyro_bias);
  visit(&p.accel_bias);
}

void PutTags(const std::vector<TagObservation>& tags, ByteWriter* writer) {
  writer->PutCount(tags.size());
  for (const TagObservation& seen : tags) {
    writer->Put(seen.tag.family);
    writer->Put(seen.tag.id);
    for (const Eigen::Vector2f& corner : seen.corners) {
      writer->Put(corner);
    }
  }
}

void GetTags(ByteReader* reader, std::vector<TagObservation>* tags) {
  constexpr size_t kTagBytes =
      sizeof(TagFamily) + sizeof(int32_t) + 2 * sizeof(float) * kTagCorners;
  tags->resize(reader->GetCount(kTagBytes));
  for (TagObservation& seen : *tags) {
    reader->Get(&seen.tag.family);
    reader->Get(&seen.tag.id);
    for (Eigen::Vector2f& corner : seen.corners) {
      reader->Get(&corner);
    }
  }
}

}  // namespace

void PutCorners(const std::vector<Corner>& corners, ByteWriter* writer) {
  writer->Put(static_cast<uint32_t>(corners.size()));
  for (const Corner& corner : corners) {
    writer->Put(corner.pixel);
    writer->Put(corner.octave);
    writer->Put(corner.descriptor);
    writer->Put(corner.landmark_id);
  }
}

void GetCorners(ByteReader* reader, std::vector<Corner>* corners) {
  corners->resize(reader->GetCount(kCornerBytes));
  for (Corner& corner : *corners) {
    reader->Get(&corner.pixel);
    reader->Get(&corner.octave);
    reader->Get(&corner.descriptor);
    reader->Get(&corner.landmark_id);
  }
}

std::vector<uint8_t> ToRecord(const Keyframe& keyframe) {
  ByteRecordWriter writer;
  writer.Reserve(kOtherBytes + kCornerBytes * keyframe.corners.size() +
                 kPointBytes * keyframe.points.size());
  const auto put = [&writer](const auto* part) { writer.Put(*part); };
  VisitHead(keyframe, put);
  writer.Put(keyframe.edge.has_value());
  if (keyframe.edge) {
    VisitEdge(*keyframe.edge, put);
  }
  writer.Put(keyframe.preintegration.has_value());
  if (keyframe.preintegration) {
    VisitPreintegration(*keyframe.preintegration, put);
  }
  PutCorners(keyframe.corners, &writer);
  writer.Put(static_cast<uint32_t>(keyframe.points.size()));
  for (const MapPoint& point : keyframe.points) {
    writer.Put(point.corner);
    writer.Put(point.inverse_depth);
    writer.Put(point.inverse_depth_var);
  }
  PutTags(keyframe.tags, &writer);
  return writer.Take();
}

std::optional<Keyframe> KeyframeFromRecord(std::span<const uint8_t> record) {
  ByteRecordReader reader(record);
  const auto get = [&reader](auto* part) { reader.Get(part); };
  Keyframe keyframe;
  VisitHead(keyframe, get);
  uint8_t has_edge = 0, has_preintegration = 0;
  reader.Get(&has_edge);
  if (has_edge != 0) {
    VisitEdge(keyframe.edge.emplace(), get);
  }
  reader.Get(&has_preintegration);
  if (has_preintegration != 0) {
    VisitPreintegration(keyframe.preintegration.emplace(), get);
  }
  GetCorners(&reader, &keyframe.corners);
  keyframe.points.resize(reader.GetCount(kPointBytes));
  for (MapPoint& point : keyframe.points) {
    reader.Get(&point.corner);
    reader.Get(&point.inverse_depth);
    reader.Get(&point.inverse_depth_var);
    if (point.corner < 0 || point.corner >= static_cast<int>(keyframe.corners.size())) {
      return std::nullopt;
    }
  }
  GetTags(&reader, &keyframe.tags);
  return reader.ok() && reader.at_end() ? std::make_optional(std::move(keyframe)) : std::nullopt;
}

}  // namespace pangea
