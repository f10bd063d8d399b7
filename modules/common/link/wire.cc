#include "common/link/wire.h"

#include <algorithm>
#include <array>

namespace pangea {
namespace {

constexpr size_t kMaxSoftwareName = 100;
constexpr int kMaxPieces = kMaxKeyframeBytes / kMinPayloadBytes + 1;

template <typename T>
Parsed<T> Refused(std::string reason) {
  return {std::nullopt, std::move(reason)};
}

bool IsAgentId(int32_t id) { return id >= 1 && id <= 65535; }

// The size of all pieces but the last, which follows from the header; nothing if they do not add
// up.
std::optional<int> PieceBytes(const link_packet_t& m) {
  if (m.total_bytes < 1 || m.total_bytes > kMaxKeyframeBytes || m.count < 1 ||
      m.count > kMaxPieces || m.index < 0 || m.index >= m.count) {
    return std::nullopt;
  }
  int piece_bytes = m.num_bytes;
  if (m.index == m.count - 1 && m.count > 1) {
    piece_bytes = (m.total_bytes - m.num_bytes) / (m.count - 1);
  }
  const bool adds_up = piece_bytes >= 1 && NumPieces(m.total_bytes, piece_bytes) == m.count &&
                       m.num_bytes == std::min(piece_bytes, m.total_bytes - m.index * piece_bytes);
  return adds_up ? std::optional<int>(piece_bytes) : std::nullopt;
}

}  // namespace

uint32_t Crc32(Bytes data) {
  static const auto table = [] {
    std::array<uint32_t, 256> t{};
    for (uint32_t i = 0; i < 256; ++i) {
      uint32_t c = i;
      for (int bit = 0; bit < 8; ++bit) {
        c = (c & 1) ? 0xEDB88320u ^ (c >> 1) : c >> 1;
      }
      t[i] = c;
    }
    return t;
  }();
  uint32_t crc = 0xFFFFFFFFu;
  for (const uint8_t byte : data) {
    crc = table[(crc ^ byte) & 0xFF] ^ (crc >> 8);
  }
  return ~crc;
}

int NumPieces(int total_bytes, int payload_bytes) {
  return (total_bytes + payload_bytes - 1) / payload_bytes;
}

Bytes Piece(Bytes message, int payload_bytes, int index) {
  const size_t begin = static_cast<size_t>(index) * static_cast<size_t>(payload_bytes);
  return message.subspan(begin,
                         std::min(static_cast<size_t>(payload_bytes), message.size() - begin));
}

link_packet_t ToMessage(const LinkPacket& packet) {
  link_packet_t m{};
  m.agent_id = packet.agent_id;
  m.run = packet.run;
  m.number = packet.number;
  m.kind = static_cast<int8_t>(packet.kind);
  m.keyframe = ToMessage(packet.keyframe);
  m.index = static_cast<int16_t>(packet.index);
  m.count = static_cast<int16_t>(packet.count);
  m.total_bytes = packet.total_bytes;
  m.crc32 = static_cast<int32_t>(packet.crc32);
  m.num_bytes = static_cast<int16_t>(packet.data.size());
  m.data = packet.data;
  return m;
}

link_hello_t ToMessage(const LinkHello& hello) {
  link_hello_t m{};
  m.software = hello.software;
  for (const LinkMap& map : hello.maps) {
    link_map_t item{};
    item.map = ToMessage(map.map);
    item.first_seq = map.first_seq;
    item.correction_revision = map.correction_revision;
    m.maps.push_back(item);
  }
  m.num_maps = static_cast<int16_t>(m.maps.size());
  return m;
}

link_ack_t ToMessage(const LinkAck& ack) {
  link_ack_t m{};
  m.agent_id = ack.agent_id;
  m.run = ack.run;
  m.number = ack.number;
  m.uplink_run = ack.uplink_run;
  m.highest_number = ack.highest_number;
  m.cache_bytes = ack.cache_bytes;
  for (const auto& [map, seq] : ack.journalled_seq) {
    m.maps.push_back(ToMessage(map));
    m.journalled_seq.push_back(seq);
  }
  m.num_maps = static_cast<int16_t>(m.maps.size());
  for (const auto& [keyframe, received] : ack.partial) {
    link_partial_t item{};
    item.keyframe = ToMessage(keyframe);
    item.num_bytes = static_cast<int16_t>(received.size());
    item.received = received;
    m.partial.push_back(item);
  }
  m.num_partial = static_cast<int16_t>(m.partial.size());
  for (const Correction& correction : ack.corrections) {
    m.corrections.push_back(ToMessage(correction));
  }
  m.num_corrections = static_cast<int16_t>(m.corrections.size());
  return m;
}

Parsed<LinkPacket> Parse(const link_packet_t& m) {
  if (!IsAgentId(m.agent_id) || m.run < 1 || m.number < 1) {
    return Refused<LinkPacket>("packet: agent, run or number out of range");
  }
  LinkPacket packet;
  packet.agent_id = m.agent_id;
  packet.run = m.run;
  packet.number = m.number;
  if (m.num_bytes < 1 || m.num_bytes > kMaxPayloadBytes) {
    return Refused<LinkPacket>("packet: size out of range");
  }
  switch (m.kind) {
    case link_packet_t::KIND_HELLO:
    case link_packet_t::KIND_POSE:
      break;
    case link_packet_t::KIND_KEYFRAME: {
      const auto keyframe = Parse(m.keyframe);
      if (!keyframe.value || keyframe.value->map.agent_id != m.agent_id) {
        return Refused<LinkPacket>("packet: keyframe id invalid or another agent's");
      }
      const auto piece_bytes = PieceBytes(m);
      if (!piece_bytes) {
        return Refused<LinkPacket>("packet: pieces do not add up");
      }
      packet.offset = m.index * *piece_bytes;
      packet.keyframe = *keyframe.value;
      break;
    }
    default:
      return Refused<LinkPacket>("packet: unknown kind");
  }
  packet.kind = static_cast<LinkPacket::Kind>(m.kind);
  packet.index = m.index;
  packet.count = m.count;
  packet.total_bytes = m.total_bytes;
  packet.crc32 = static_cast<uint32_t>(m.crc32);
  packet.data = m.data;
  return {std::move(packet), ""};
}

Parsed<LinkHello> Parse(const link_hello_t& m) {
  if (m.num_maps < 0 || m.num_maps > kMaxLinkMaps) {
    return Refused<LinkHello>("hello: too many maps");
  }
  LinkHello hello;
  hello.software = m.software.substr(0, kMaxSoftwareName);
  for (const link_map_t& item : m.maps) {
    const auto map = Parse(item.map);
    if (!map.value || item.first_seq < 0 || item.correction_revision < 0) {
      return Refused<LinkHello>("hello: map invalid");
    }
    hello.maps.push_back({*map.value, item.first_seq, item.correction_revision});
  }
  return {std::move(hello), ""};
}

Parsed<LinkAck> Parse(const link_ack_t& m) {
  if (!IsAgentId(m.agent_id) || m.run < 1 || m.number < 1 || m.highest_number < 0 ||
      m.cache_bytes < 1 || m.num_maps < 0 || m.num_maps > kMaxAckMaps || m.num_partial < 0 ||
      m.num_partial > kMaxPartialKeyframes || m.num_corrections < 0 ||
      m.num_corrections > kMaxLinkCorrections) {
    return Refused<LinkAck>("acknowledgement: a field is out of range");
  }
  LinkAck ack{m.agent_id, m.run, m.number, m.uplink_run, m.highest_number, m.cache_bytes,
              {},         {},    {}};
  for (int i = 0; i < m.num_maps; ++i) {
    const auto map = Parse(m.maps[i]);
    if (!map.value || map.value->agent_id != m.agent_id || m.journalled_seq[i] < -1) {
      return Refused<LinkAck>("acknowledgement: map invalid");
    }
    ack.journalled_seq[*map.value] = m.journalled_seq[i];
  }
  for (const link_partial_t& item : m.partial) {
    const auto keyframe = Parse(item.keyframe);
    if (!keyframe.value || item.num_bytes < 1 || item.num_bytes > kMaxPieces / 8 + 1) {
      return Refused<LinkAck>("acknowledgement: keyframe invalid");
    }
    ack.partial[*keyframe.value] = item.received;
  }
  for (const correction_t& item : m.corrections) {
    auto correction = Parse(item);
    if (!correction.value || correction.value->map.agent_id != m.agent_id) {
      return Refused<LinkAck>("acknowledgement: correction invalid");
    }
    ack.corrections.push_back(std::move(*correction.value));
  }
  return {std::move(ack), ""};
}

}  // namespace pangea
