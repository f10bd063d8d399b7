#include "link/wire.h"

#include <algorithm>
#include <limits>
#include <set>

#include "link/bytes_io.h"
#include "messages/encoding.h"
#include "messages/messages_checks.h"

namespace pangea {
namespace {

constexpr size_t kMaxReason = 300;
constexpr uint64_t kMaxSeq = 10'000'000;
constexpr uint64_t kMaxInt32 = std::numeric_limits<int32_t>::max();
constexpr uint64_t kMaxInt64 = std::numeric_limits<int64_t>::max();
constexpr uint64_t kMaxEncodedCorrection = 1000;
constexpr int64_t kMaxUtime = int64_t{1} << 60;
constexpr double kMaxSpeed = 1000;  // m/s

using messages_checks::Refused;

// Whether the text can be shown to people: it cannot control a terminal.
bool Printable(const std::string& text) {
  return std::all_of(text.begin(), text.end(),
                     [](char c) { return static_cast<uint8_t>(c) >= ' ' && c != 0x7F; });
}

int32_t ReadInt32(WireReader* reader, uint64_t max = kMaxInt32) {
  return static_cast<int32_t>(reader->Varint(max));
}

int64_t ReadInt64(WireReader* reader) { return static_cast<int64_t>(reader->Varint(kMaxInt64)); }

void Write(const rigid3_t& T, WireWriter* writer) {
  for (const double value : {T.rotation.w, T.rotation.x, T.rotation.y, T.rotation.z,
                             T.translation.x, T.translation.y, T.translation.z}) {
    writer->Fixed(static_cast<float>(value));
  }
}

void Write(const vector3_t& v, WireWriter* writer) {
  for (const double value : {v.x, v.y, v.z}) {
    writer->Fixed(static_cast<float>(value));
  }
}

vector3_t ReadVector(WireReader* reader) {
  vector3_t v{};
  for (double* value : {&v.x, &v.y, &v.z}) {
    *value = reader->Fixed<float>();
  }
  return v;
}

rigid3_t ReadRigid3(WireReader* reader) {
  rigid3_t T{};
  for (double* value : {&T.rotation.w, &T.rotation.x, &T.rotation.y, &T.rotation.z}) {
    *value = reader->Fixed<float>();
  }
  T.translation = ReadVector(reader);
  return T;
}

}  // namespace

std::string OurSoftware() { return "pangea " PANGEA_VERSION; }

int NumPieces(int total_bytes, int payload_bytes) {
  return (total_bytes + payload_bytes - 1) / payload_bytes;
}

Bytes Piece(Bytes message, int payload_bytes, int index) {
  const size_t begin = static_cast<size_t>(index) * static_cast<size_t>(payload_bytes);
  return message.subspan(begin,
                         std::min(static_cast<size_t>(payload_bytes), message.size() - begin));
}

std::vector<uint8_t> Encode(const LinkHello& hello) {
  WireWriter writer;
  writer.Text(std::string_view(hello.software).substr(0, kMaxSoftwareName));
  writer.Varint(hello.maps.size());
  for (const LinkMap& map : hello.maps) {
    writer.Fixed(map.slot);
    writer.Fixed(map.map.opened_utime);
    writer.Varint(static_cast<uint64_t>(map.first_seq));
    writer.Varint(static_cast<uint64_t>(map.correction_revision));
  }
  return writer.Take();
}

Parsed<LinkHello> ParseHello(int32_t agent_id, Bytes body) {
  WireReader reader(body);
  LinkHello hello;
  hello.software = reader.Text(kMaxSoftwareName);
  if (!Printable(hello.software)) {
    return Refused<LinkHello>("hello: software is not printable");
  }
  const uint64_t num_maps = reader.Varint(kMaxLinkMaps);
  std::set<uint8_t> slots;
  for (uint64_t i = 0; i < num_maps && reader.ok(); ++i) {
    LinkMap& map = hello.maps.emplace_back();
    map.slot = reader.Fixed<uint8_t>();
    map.map = {agent_id, reader.Fixed<int64_t>()};
    map.first_seq = ReadInt32(&reader, kMaxSeq);
    map.correction_revision = ReadInt64(&reader);
    if (!Parse(ToMessage(map.map)).value || !slots.insert(map.slot).second) {
      return Refused<LinkHello>("hello: map or slot invalid");
    }
  }
  return reader.AtEnd() ? Parsed<LinkHello>{std::move(hello), ""}
                        : Refused<LinkHello>("hello does not decode");
}

std::vector<uint8_t> Encode(const LinkPiece& piece) {
  WireWriter writer;
  writer.Fixed(piece.slot);
  writer.Fixed(piece.seq_low);
  writer.Fixed(static_cast<uint8_t>(piece.index));
  writer.Raw(piece.data);
  return writer.Take();
}

Parsed<LinkPiece> ParsePiece(const LinkPacket& packet) {
  WireReader reader(packet.body);
  LinkPiece piece;
  piece.slot = reader.Fixed<uint8_t>();
  piece.seq_low = reader.Fixed<uint8_t>();
  piece.index = reader.Fixed<uint8_t>();
  piece.last = packet.kind == LinkKind::kLastPiece;
  piece.data = reader.Rest();
  if (piece.data.empty() || piece.data.size() > size_t{kMaxPayloadBytes} ||
      piece.index >= kMaxPieces) {
    return Refused<LinkPiece>("piece: size or index out of range");
  }
  return {piece, ""};
}

std::vector<uint8_t> EncodePose(const pose_t& pose) {
  WireWriter writer;
  writer.Fixed(pose.utime);
  writer.Fixed(pose.state);
  writer.Text(std::string_view(pose.reason).substr(0, kMaxReason));
  writer.Fixed(pose.map.opened_utime);
  Write(pose.T_odom_body, &writer);
  Write(pose.v_odom_body, &writer);
  Write(pose.T_map_body, &writer);
  writer.Varint(static_cast<uint64_t>(std::max<int64_t>(0, pose.group_revision)));
  writer.Varint(static_cast<uint64_t>(std::max(0, pose.num_tracked)));
  return writer.Take();
}

Parsed<pose_t> ParsePose(int32_t agent_id, Bytes body) {
  WireReader reader(body);
  pose_t pose{};
  pose.utime = reader.Fixed<int64_t>();
  pose.state = reader.Fixed<int8_t>();
  pose.reason = reader.Text(kMaxReason);
  pose.map.agent_id = agent_id;
  pose.map.opened_utime = reader.Fixed<int64_t>();
  pose.T_odom_body = ReadRigid3(&reader);
  pose.v_odom_body = ReadVector(&reader);
  pose.T_map_body = ReadRigid3(&reader);
  pose.group_revision = ReadInt64(&reader);
  pose.num_tracked = ReadInt32(&reader);
  if (!reader.AtEnd() || !Parse(pose.map).value) {
    return Refused<pose_t>("pose does not decode");
  }
  if (pose.utime < 0 || pose.utime > kMaxUtime) {
    return Refused<pose_t>("pose: time out of range");
  }
  if (pose.state < pose_t::STATE_INVALID || pose.state > pose_t::STATE_LOST) {
    return Refused<pose_t>("pose: no such state");
  }
  if (!Printable(pose.reason)) {
    return Refused<pose_t>("pose: reason is not printable");
  }
  if (pose.state != pose_t::STATE_TRACKING) {  // then there is no pose
    pose.T_odom_body = pose.T_map_body = {};
    pose.v_odom_body = {};
    return {std::move(pose), ""};
  }
  const auto T_odom_body = Parse(pose.T_odom_body), T_map_body = Parse(pose.T_map_body);
  if (!T_odom_body.value || !T_map_body.value) {
    return Refused<pose_t>("pose is no rigid transform");
  }
  if (!messages_checks::Bounded(messages_checks::ToVector(pose.v_odom_body), kMaxSpeed)) {
    return Refused<pose_t>("pose: velocity out of range");
  }
  pose.T_odom_body = ToMessage(*T_odom_body.value);  // quaternions are again of unit norm
  pose.T_map_body = ToMessage(*T_map_body.value);
  return {std::move(pose), ""};
}

std::vector<uint8_t> Encode(const LinkAck& ack) {
  WireWriter writer;
  writer.Varint(static_cast<uint64_t>(ack.highest_number));
  writer.Varint(static_cast<uint64_t>(ack.cache_bytes));
  writer.Varint(ack.journalled_seq.size());
  std::map<MapId, uint8_t> index_of;
  for (const auto& [map, seq] : ack.journalled_seq) {
    index_of.emplace(map, static_cast<uint8_t>(index_of.size()));
    writer.Fixed(map.opened_utime);
    writer.Varint(static_cast<uint64_t>(int64_t{seq} + 1));
  }
  writer.Varint(ack.partial.size());
  for (const auto& [keyframe, received] : ack.partial) {
    writer.Fixed(index_of.at(keyframe.map));
    writer.Varint(static_cast<uint64_t>(keyframe.seq));
    writer.Sized(received);
  }
  writer.Varint(ack.corrections.size());
  for (const Correction& correction : ack.corrections) {
    writer.Sized(EncodeMessage(ToMessage(correction)));
  }
  return writer.Take();
}

Parsed<LinkAck> ParseAck(int32_t agent_id, const LinkPacket& packet) {
  WireReader reader(packet.body);
  LinkAck ack;
  ack.number = packet.number;
  ack.highest_number = ReadInt64(&reader);
  ack.cache_bytes = ReadInt32(&reader);
  std::vector<MapId> maps;
  const uint64_t num_maps = reader.Varint(kMaxAckMaps);
  for (uint64_t i = 0; i < num_maps && reader.ok(); ++i) {
    maps.push_back({agent_id, reader.Fixed<int64_t>()});
    ack.journalled_seq[maps.back()] = ReadInt32(&reader, kMaxSeq + 1) - 1;
    if (!Parse(ToMessage(maps.back())).value) {
      return Refused<LinkAck>("acknowledgement: map invalid");
    }
  }
  const uint64_t num_partial = reader.Varint(kMaxPartialKeyframes);
  for (uint64_t i = 0; i < num_partial && reader.ok(); ++i) {
    const auto map = reader.Fixed<uint8_t>();
    const int32_t seq = ReadInt32(&reader, kMaxSeq);
    const Bytes received = reader.Sized(kMaxPieces / 8 + 1);
    if (map >= maps.size()) {
      return Refused<LinkAck>("acknowledgement: keyframe invalid");
    }
    ack.partial[{maps[map], seq}].assign(received.begin(), received.end());
  }
  const uint64_t num_corrections = reader.Varint(kMaxLinkCorrections);
  for (uint64_t i = 0; i < num_corrections && reader.ok(); ++i) {
    correction_t message{};
    const bool decoded = DecodeMessage(reader.Sized(kMaxEncodedCorrection), &message);
    auto correction = decoded ? Parse(message) : Refused<Correction>("");
    if (!correction.value || correction.value->map.agent_id != agent_id) {
      return Refused<LinkAck>("acknowledgement: correction invalid");
    }
    ack.corrections.push_back(std::move(*correction.value));
  }
  if (!reader.AtEnd() || ack.cache_bytes < 1) {
    return Refused<LinkAck>("acknowledgement does not decode");
  }
  return {std::move(ack), ""};
}

}  // namespace pangea
