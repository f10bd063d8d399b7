#include "log_file/log_event.h"

#include <algorithm>

#include "core/big_endian.h"
#include "files/disk_io.h"

namespace pangea {
namespace {

// The header is big-endian: magic, event number, time stamp, length of the channel's name, length
// of the data.
constexpr uint32_t kMaxChannelName = 63;

}  // namespace

size_t AppendLogEvent(int64_t number, int64_t utime, const std::string& channel, Bytes data,
                      std::vector<uint8_t>* out) {
  PutBigEndian(kLogMagic, 4, out);
  PutBigEndian(static_cast<uint64_t>(number), 8, out);
  PutBigEndian(static_cast<uint64_t>(utime), 8, out);
  PutBigEndian(channel.size(), 4, out);
  PutBigEndian(data.size(), 4, out);
  out->insert(out->end(), channel.begin(), channel.end());
  const size_t begin = out->size();
  out->insert(out->end(), data.begin(), data.end());
  return begin;
}

std::optional<LogEventHeader> ParseLogEventHeader(Bytes bytes) {
  if (bytes.size() < LogEventHeader::kBytes || GetBigEndian(bytes.data(), 4) != kLogMagic) {
    return std::nullopt;
  }
  const auto channel_bytes = static_cast<uint32_t>(GetBigEndian(bytes.data() + 20, 4));
  const auto data_bytes = static_cast<uint32_t>(GetBigEndian(bytes.data() + 24, 4));
  if (channel_bytes < 1 || channel_bytes > kMaxChannelName ||
      data_bytes > LogEventHeader::kMaxDataBytes) {
    return std::nullopt;
  }
  return LogEventHeader{static_cast<int64_t>(GetBigEndian(bytes.data() + 4, 8)),
                        static_cast<int64_t>(GetBigEndian(bytes.data() + 12, 8)),
                        static_cast<int32_t>(channel_bytes), static_cast<int32_t>(data_bytes)};
}

bool BeginsAsLogEvent(int fd, int64_t offset, int64_t bytes) {
  std::vector<uint8_t> magic;
  PutBigEndian(kLogMagic, 4, &magic);
  std::vector<uint8_t> begin(static_cast<size_t>(std::min<int64_t>(bytes, 4)));
  return ReadFully(fd, offset, begin.data(), begin.size()) &&
         std::equal(begin.begin(), begin.end(), magic.begin());
}

}  // namespace pangea
