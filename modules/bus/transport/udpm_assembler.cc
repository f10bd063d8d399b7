#include "bus/transport/udpm_assembler.h"

#include <algorithm>

#include "core/big_endian.h"

namespace pangea {
namespace {

constexpr size_t kShortHeader = 8;
constexpr size_t kFragmentHeader = 20;
// Least memory of a piece and of an incomplete message, beside their data.
constexpr size_t kPieceOverhead = 128;
constexpr size_t kPartialOverhead = 256;

// Even the largest message, in the largest number of pieces, stays within the bound by itself.
static_assert(UdpmAssembler::kMaxMessage + 65'535 * kPieceOverhead + kPartialOverhead <=
              UdpmAssembler::kMaxPartialBytes);

uint16_t HalfAt(Bytes bytes, size_t at) {
  return static_cast<uint16_t>(GetBigEndian(bytes.data() + at, 2));
}

// The channel name at the beginning of the bytes, up to a 0 byte; empty if there is none.
std::string ChannelIn(Bytes bytes) {
  const Bytes name = bytes.first(std::min(bytes.size(), UdpmAssembler::kMaxChannel + 1));
  const auto end = std::find(name.begin(), name.end(), 0);
  return end == name.end() ? std::string() : std::string(name.begin(), end);
}

}  // namespace

std::nullopt_t UdpmAssembler::Refuse(const char* reason) {
  ++refused_[reason];
  return std::nullopt;
}

std::optional<UdpmAssembler::Message> UdpmAssembler::Take(Bytes datagram, uint64_t sender) {
  joined_ = {};
  if (datagram.size() < kShortHeader) {
    return Refuse("datagram: shorter than a header");
  }
  switch (WordAt(datagram, 0)) {
    case kUdpmShortMagic:
      return TakeShort(datagram);
    case kUdpmFragmentMagic:
      return TakeFragment(datagram, sender);
    default:
      return Refuse("datagram: not of LCM");
  }
}

std::optional<UdpmAssembler::Message> UdpmAssembler::TakeShort(Bytes datagram) {
  const Bytes rest = datagram.subspan(kShortHeader);
  std::string channel = ChannelIn(rest);
  if (channel.empty()) {
    return Refuse("datagram: no channel of 1 to 63 characters");
  }
  const Bytes data = rest.subspan(channel.size() + 1);
  return Message{std::move(channel), data};
}

std::optional<UdpmAssembler::Fragment> UdpmAssembler::ParseFragment(Bytes datagram) {
  if (datagram.size() < kFragmentHeader) {
    return Refuse("datagram: shorter than a header");
  }
  Fragment fragment{WordAt(datagram, 4),
                    WordAt(datagram, 8),
                    WordAt(datagram, 12),
                    HalfAt(datagram, 16),
                    HalfAt(datagram, 18),
                    {},
                    datagram.subspan(kFragmentHeader)};
  if (fragment.number >= fragment.count) {
    return Refuse("fragment: its number is not below their count");
  }
  if (fragment.message_bytes > kMaxMessage) {
    return Refuse("fragment: of a message beyond 16 MiB");
  }
  if (fragment.number == 0) {
    fragment.channel = ChannelIn(fragment.data);
    if (fragment.channel.empty()) {
      return Refuse("datagram: no channel of 1 to 63 characters");
    }
    fragment.data = fragment.data.subspan(fragment.channel.size() + 1);
  }
  if (fragment.data.empty()) {
    return Refuse("fragment: empty");
  }
  if (uint64_t{fragment.offset} + fragment.data.size() > fragment.message_bytes) {
    return Refuse("fragment: beyond its message");
  }
  return fragment;
}

// Whether the fragment is of another message. A restarted sender may use a message number again.
bool UdpmAssembler::Contradicts(const Partial& partial, const Fragment& fragment) {
  if (partial.message_bytes != fragment.message_bytes || partial.count != fragment.count) {
    return true;
  }
  const auto known = partial.pieces.find(fragment.number);
  return known != partial.pieces.end() &&
         (known->second.offset != fragment.offset ||
          !std::ranges::equal(known->second.data, fragment.data) ||
          (fragment.number == 0 && partial.channel != fragment.channel));
}

// Finds or begins the incomplete message, and moves it to the end of the list.
UdpmAssembler::Partials::iterator UdpmAssembler::PartialOf(const Key& key,
                                                           const Fragment& fragment) {
  const auto known = by_key_.find(key);
  if (known != by_key_.end() && !Contradicts(*known->second, fragment)) {
    partials_.splice(partials_.end(), partials_, known->second);
    return known->second;
  }
  if (known != by_key_.end()) {
    Refuse("fragment: an earlier one says otherwise");
    Remove(known->second);
  }
  const auto begun = partials_.insert(
      partials_.end(), {key, fragment.message_bytes, fragment.count, {}, 0, kPartialOverhead, {}});
  by_key_[key] = begun;
  partial_bytes_ += kPartialOverhead;
  return begun;
}

void UdpmAssembler::Add(const Fragment& fragment, Partial* partial) {
  if (!partial->pieces
           .emplace(fragment.number,
                    Piece{fragment.offset, {fragment.data.begin(), fragment.data.end()}})
           .second) {
    Refuse("fragment: repeated");
    return;
  }
  if (fragment.number == 0) {
    partial->channel = fragment.channel;
  }
  const size_t cost = fragment.data.size() + kPieceOverhead;
  partial->received_bytes += fragment.data.size();
  partial->cost_bytes += cost;
  partial_bytes_ += cost;
}

// All pieces are there. They must follow one another without a gap or overlap.
std::optional<UdpmAssembler::Message> UdpmAssembler::Join(const Partial& partial) {
  joined_.reserve(partial.received_bytes);
  for (const auto& [number, piece] : partial.pieces) {
    if (piece.offset != joined_.size()) {
      break;
    }
    joined_.insert(joined_.end(), piece.data.begin(), piece.data.end());
  }
  if (joined_.size() != partial.message_bytes) {
    return Refuse("fragments that do not fit each other");
  }
  return Message{partial.channel, joined_};
}

std::optional<UdpmAssembler::Message> UdpmAssembler::TakeFragment(Bytes datagram, uint64_t sender) {
  const std::optional<Fragment> fragment = ParseFragment(datagram);
  if (!fragment) {
    return std::nullopt;
  }
  const Partials::iterator partial = PartialOf({sender, fragment->message_number}, *fragment);
  Add(*fragment, &*partial);
  if (partial->received_bytes > partial->message_bytes) {
    Remove(partial);
    return Refuse("fragments that do not fit each other");
  }
  if (partial->pieces.size() < partial->count) {
    KeepWithinBounds();
    return std::nullopt;
  }
  std::optional<Message> message = Join(*partial);
  Remove(partial);
  return message;
}

void UdpmAssembler::Remove(Partials::iterator partial) {
  partial_bytes_ -= partial->cost_bytes;
  by_key_.erase(partial->key);
  partials_.erase(partial);
}

void UdpmAssembler::KeepWithinBounds() {
  while (partials_.size() > kMaxPartials || partial_bytes_ > kMaxPartialBytes) {
    Refuse("message that lacked fragments too long");
    Remove(partials_.begin());
  }
}

}  // namespace pangea
