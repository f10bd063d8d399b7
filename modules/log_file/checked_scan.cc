#include "log_file/checked_scan.h"

#include <utility>

#include "messages/channels.h"

namespace pangea {

bool FillsDamage(const LogPiece& event) { return channels::kDamaged.starts_with(event.channel); }

uint32_t CheckedScan::Piece::crc32() const {
  if (!crc32_) {
    crc32_ = EventChecksum(whole);
  }
  return *crc32_;
}

const CheckedScan::Piece* CheckedScan::Next() {
  while (num_ready_ == 0) {
    if (!Read()) {
      return nullptr;
    }
  }
  current_ = std::move(waiting_.front());
  waiting_.pop_front();
  waiting_bytes_ -= current_.bytes.size();
  --num_ready_;
  return &current_.piece;
}

// Reads one more piece. False at the end of the file if no piece is waiting.
bool CheckedScan::Read() {
  const auto read = scan_.Next();
  if (!read) {
    num_ready_ = waiting_.size();
    return num_ready_ > 0;
  }
  Waiting& next = waiting_.emplace_back();
  static_cast<LogPiece&>(next.piece) = *read;
  next.bytes.assign(read->whole.begin(), read->whole.end());
  next.piece.whole = next.bytes;
  next.piece.data = Bytes(next.bytes).last(read->data.size());
  waiting_bytes_ += next.bytes.size();
  const bool is_list = read->channel == channels::kChecksums;
  if (const auto checksums = is_list ? ChecksumsOf(next.bytes) : std::nullopt) {
    Verify(*checksums);
    num_ready_ = waiting_.size();
  } else if (waiting_bytes_ > kMaxWaitingBytes) {
    num_ready_ = 1;
  }
  return true;
}

// Repeated while it finds damage, because a mended file no longer says which event was damaged, and
// reading it must give the same result.
void CheckedScan::Verify(const Checksums& checksums) {
  while (FindDamage(checksums)) {
  }
}

// Goes backwards from the CHECKSUMS event. The number of an event follows from its place. Beyond
// damage, which may have destroyed any number of events, the event's own header tells the number.
bool CheckedScan::FindDamage(const Checksums& checksums) {
  int64_t expected = checksums.event_number() - 1;
  bool in_place = true;
  bool found = false;
  for (auto it = std::next(waiting_.rbegin());
       it != waiting_.rend() && expected >= checksums.first_event; ++it) {
    Piece& piece = it->piece;
    if (piece.kind != LogPiece::Kind::kEvent || FillsDamage(piece)) {
      in_place = false;
      continue;
    }
    const int64_t number = in_place ? expected : piece.header.number;
    if (number < checksums.first_event || number > expected) {
      continue;  // the event is older than those of the list, or its number is not credible
    }
    const auto index = static_cast<size_t>(number - checksums.first_event);
    if (piece.crc32() != checksums.crc32[index]) {
      piece.kind = LogPiece::Kind::kDamage;
      found = true;
    }
    expected = number - 1;
    in_place = true;
  }
  return found;
}

}  // namespace pangea
