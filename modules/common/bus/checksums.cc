#include "common/bus/checksums.h"

#include <boost/crc.hpp>

#include "pangea/checksums_t.hpp"

namespace pangea {

uint32_t EventChecksum(Bytes event) {
  boost::crc_32_type crc;
  crc.process_bytes(event.data(), event.size());
  return crc.checksum();
}

std::vector<uint8_t> EncodeChecksums(const Checksums& checksums) {
  checksums_t message{};
  message.first_event = checksums.first_event;
  message.num_events = static_cast<int32_t>(checksums.crc32.size());
  message.crc32.assign(checksums.crc32.begin(), checksums.crc32.end());
  return EncodeMessage(message);
}

std::optional<Checksums> DecodeChecksums(Bytes data) {
  checksums_t message{};
  if (!DecodeMessage(data, &message) || message.crc32.size() > Checksums::kMax) {
    return std::nullopt;
  }
  return Checksums{message.first_event, {message.crc32.begin(), message.crc32.end()}};
}

}  // namespace pangea
