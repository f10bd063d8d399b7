#include "gateway/recording/recording_socket.h"

#include <fmt/format.h>

#include <utility>

namespace pangea {
namespace {

constexpr size_t kIntegerBytes = 8;

uint64_t IntegerOf(Bytes bytes) {
  uint64_t value = 0;
  for (size_t i = 0; i < kIntegerBytes; ++i) {
    value |= static_cast<uint64_t>(bytes[i]) << (8 * i);
  }
  return value;
}

std::vector<uint8_t> BytesOf(int64_t value) {
  std::vector<uint8_t> bytes;
  for (size_t i = 0; i < kIntegerBytes; ++i) {
    bytes.push_back(static_cast<uint8_t>(static_cast<uint64_t>(value) >> (8 * i)));
  }
  return bytes;
}

// Whether the bytes are the signature with which a zip begins.
bool IsBeginOfZip(Bytes bytes) {
  return bytes.size() >= 4 && bytes[0] == 'P' && bytes[1] == 'K' && bytes[2] == 3 && bytes[3] == 4;
}

}  // namespace

RecordingSocket::~RecordingSocket() { Abort(); }

void RecordingSocket::End(const web::WebEnding& ending) {
  AgentSocket::End(ending);
  Abort();
}

void RecordingSocket::Abort() {
  if (std::exchange(is_stored_, false)) {
    owner_.recordings().Abort(agent_id());
  }
}

bool RecordingSocket::Begin() {
  last_us_ = now_us();
  return owner_.OnUpload(this);
}

bool RecordingSocket::Refuse(uint16_t code, const std::string& why) {
  End({code, why});
  return false;
}

std::optional<std::vector<uint8_t>> RecordingSocket::NextMessage() {
  if (Ending()) {
    return std::nullopt;
  }
  if (now_us() > last_us_ + kStalled_us) {
    Refuse(kMalformed, "nothing came for 30 s");
    return std::nullopt;
  }
  rate_.Refill(now_us());
  if (size_ == 0 || told_ == received_ || !rate_.Ready()) {
    return std::nullopt;
  }
  rate_.Take(received_ - std::max<int64_t>(told_, 0));
  told_ = received_;
  return BytesOf(told_);
}

bool RecordingSocket::ReceiveMessage(Bytes message) {
  last_us_ = now_us();
  return size_ == 0 ? TakeSize(message) : TakeBytes(message);
}

bool RecordingSocket::TakeSize(Bytes message) {
  const uint64_t size = message.size() == kIntegerBytes ? IntegerOf(message) : 0;
  if (size == 0) {
    return Refuse(kMalformed, "this is no size of a recording");
  }
  if (size > static_cast<uint64_t>(kMaxRecording)) {
    return Refuse(kNotTaken,
                  fmt::format("a recording may have {} MB at most", kMaxRecording / 1'000'000));
  }
  if (const std::string error = owner_.recordings().Begin(agent_id(), static_cast<int64_t>(size));
      !error.empty()) {
    return Refuse(kNotTaken, error);
  }
  size_ = static_cast<int64_t>(size);
  is_stored_ = true;
  return true;
}

bool RecordingSocket::TakeBytes(Bytes message) {
  const bool is_first = received_ == 0;
  received_ += static_cast<int64_t>(message.size());
  if (message.empty() || received_ > size_ || received_ > std::max<int64_t>(told_, 0) + kWindow ||
      (is_first && !IsBeginOfZip(message))) {
    return Refuse(kMalformed, "this is no zip, or it comes faster than it is taken");
  }
  RecordingStore& store = owner_.recordings();
  if (const std::string error = store.Write(agent_id(), message); !error.empty()) {
    return Refuse(kNotTaken, error);
  }
  if (received_ < size_) {
    return true;
  }
  is_stored_ = false;
  const RecordingStore::Kept kept = store.Finish(agent_id());
  if (!kept.error.empty()) {
    return Refuse(kNotTaken, kept.error);
  }
  Finish({kKept, kept.file});
  return true;
}

}  // namespace pangea
