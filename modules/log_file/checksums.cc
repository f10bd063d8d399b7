#include "log_file/checksums.h"

#include <zlib.h>

#include <string>

#include "core/big_endian.h"
#include "log_file/log_event.h"
#include "messages/channels.h"
#include "messages/encoding.h"
#include "pangea/checksums_t.hpp"

namespace pangea {
namespace {

constexpr std::ptrdiff_t kOwnBytes = 4;  // size of own_crc32, the message's last field

}  // namespace

uint32_t EventChecksum(Bytes event) {
  return static_cast<uint32_t>(crc32_z(0, event.data(), event.size()));
}

void AppendChecksumsEvent(const Checksums& checksums, int64_t utime, std::vector<uint8_t>* out) {
  checksums_t message{};
  message.first_event = checksums.first_event;
  message.num_events = static_cast<int32_t>(checksums.crc32.size());
  message.crc32.assign(checksums.crc32.begin(), checksums.crc32.end());
  const size_t begin = out->size();
  AppendLogEvent(checksums.event_number(), utime, std::string(channels::kChecksums),
                 EncodeMessage(message), out);
  out->erase(out->end() - kOwnBytes, out->end());
  PutBigEndian(EventChecksum(Bytes(*out).subspan(begin)), kOwnBytes, out);
}

std::optional<Checksums> ChecksumsOf(Bytes event) {
  const auto header = ParseLogEventHeader(event);
  checksums_t message{};
  if (!header || header->event_bytes() != static_cast<int64_t>(event.size()) ||
      !DecodeMessage(event.last(static_cast<size_t>(header->data_bytes)), &message)) {
    return std::nullopt;
  }
  const uint32_t own = EventChecksum(event.first(event.size() - size_t{kOwnBytes}));
  const bool in_place =
      message.first_event >= 0 && header->number >= message.first_event &&
      header->number - message.first_event == static_cast<int64_t>(message.crc32.size());
  if (static_cast<uint32_t>(message.own_crc32) != own || !in_place ||
      message.crc32.size() > Checksums::kMax) {
    return std::nullopt;
  }
  return Checksums{message.first_event, {message.crc32.begin(), message.crc32.end()}};
}

}  // namespace pangea
