#include "cluster/journal_shipper.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <fstream>
#include <thread>

#include "files/whole_file.h"
#include "journal_follower/journal_reader.h"
#include "log_file/checked_scan.h"
#include "log_file/checksums.h"
#include "messages/channels.h"

namespace pangea {
namespace {

namespace fs = std::filesystem;

// Storing the term is tried again while another core still writes, or NATS elects a leader.
constexpr int kTries = 100;
constexpr std::chrono::milliseconds kBetweenTries{100};

fs::path CursorFile(const fs::path& journal) { return journal.string() + ".stream"; }

// A file that is closed by the destructor.
struct OpenJournal {
  explicit OpenJournal(const std::string& path) : fd(open(path.c_str(), O_RDONLY | O_CLOEXEC)) {}
  ~OpenJournal() { close(fd); }
  OpenJournal(const OpenJournal&) = delete;
  OpenJournal& operator=(const OpenJournal&) = delete;
  const int fd;
};

}  // namespace

JournalCursor JournalCursor::Read(const fs::path& journal, SiteStreams& streams) {
  JournalCursor cursor;
  std::ifstream text(CursorFile(journal));
  text >> cursor.file.num_bytes >> cursor.file.last_event_offset >> cursor.file.last_event_crc32 >>
      cursor.sequence >> cursor.term;
  try {
    if (text) {
      JournalReader({journal.string(), cursor.file});
      const auto event = streams.EventAt(cursor.sequence);
      return event && event->term == cursor.term && cursor.term > 0 ? cursor : JournalCursor{};
    }
  } catch (const std::runtime_error&) {
  }
  return {};
}

void JournalCursor::Write(const fs::path& journal) const {
  ReplaceFile(CursorFile(journal),
              fmt::format("{} {} {} {} {}\n", file.num_bytes, file.last_event_offset,
                          file.last_event_crc32, sequence, term),
              0644);
}

uint64_t StoreTerm(SiteStreams& streams, uint64_t term) {
  for (int i = 0; i < kTries; ++i) {
    const auto end = streams.JournalEnd();
    const auto answer = end ? streams.StoreTerm(term, *end) : SiteStreams::StoreAnswer{};
    if (answer.stored == SiteStreams::Stored::kNew) {
      return answer.sequence;
    }
    std::this_thread::sleep_for(kBetweenTries);
  }
  throw std::runtime_error("NATS does not take the term of this core");
}

bool IsOfFile(const LogPiece& piece) {
  return piece.kind != LogPiece::Kind::kEvent || piece.channel == channels::kChecksums ||
         FillsDamage(piece);
}

void JournalShipper::OnJournalFile(const JournalFile& file) {
  if (shipped_.path != file.path) {
    const JournalCursor cursor = JournalCursor::Read(file.path, streams_);
    shipped_ = {file.path, cursor.file};
    sequence_ = tried_ = cursor.sequence;
    mark_ = cursor;
  }
  if (file.state.num_bytes < shipped_.state.num_bytes) {
    throw std::runtime_error(fmt::format("{} has become shorter", file.path));
  }
  wanted_bytes_ = file.state.num_bytes;
}

bool JournalShipper::FindNext(std::optional<SiteStreams::JournalEvent>* event) {
  for (; sequence_ < end_; ++sequence_) {
    *event = streams_.EventAt(sequence_ + 1);
    if (!*event) {
      return false;
    }
    if ((*event)->term > term_) {
      throw LeaseLost(
          fmt::format("another core has begun: term {} after {}", (*event)->term, term_));
    }
    if ((*event)->term == 0) {
      return true;
    }
    mark_ = {shipped_.state, sequence_ + 1, (*event)->term};
  }
  event->reset();
  return true;
}

bool JournalShipper::ShipEvent(const LogPiece& event) {
  for (;;) {
    std::optional<SiteStreams::JournalEvent> next;
    if (!FindNext(&next)) {
      return false;
    }
    if (next && (next->channel != event.channel || !std::ranges::equal(next->data, event.data))) {
      throw std::runtime_error(
          fmt::format("{}: its event at {} is not the one in NATS", shipped_.path, event.offset));
    }
    if (next) {
      ++sequence_;
      return true;
    }
    const auto answer =
        streams_.StoreEvent(event.channel, event.header.utime, event.data, sequence_);
    switch (answer.stored) {
      case SiteStreams::Stored::kNew:
        sequence_ = end_ = answer.sequence;
        return true;
      case SiteStreams::Stored::kTooLarge:
        ++num_too_large_;
        return false;  // else agents would be told that other hosts have it
      case SiteStreams::Stored::kUnreachable:
        return false;
      case SiteStreams::Stored::kOtherwise:
        end_ = streams_.JournalEnd().value_or(0);
        if (end_ <= sequence_) {
          return false;  // the node of NATS that answered does not know the newest event yet
        }
    }
  }
}

// Called when no event of the file is left: before our term the stream may only have further terms,
// because a core stores its term only when its file has all earlier events.
void JournalShipper::PassTerms() {
  std::optional<SiteStreams::JournalEvent> next;
  end_ = std::max(end_, begin_);
  if (sequence_ < begin_ && FindNext(&next) && next) {
    throw std::runtime_error(
        fmt::format("{}: lacks event {} of NATS", shipped_.path, sequence_ + 1));
  }
}

void JournalShipper::Ship() {
  if (shipped_.path.empty()) {
    return;  // the file is not known yet
  }
  ShipEvents();
  Mark();
}

void JournalShipper::Mark() {
  if (sequence_ >= begin_ && sequence_ - mark_.sequence >= kEventsPerMark) {
    const auto answer = streams_.StoreTerm(term_, sequence_);
    if (answer.stored == SiteStreams::Stored::kNew) {
      sequence_ = end_ = answer.sequence;
      mark_ = {shipped_.state, sequence_, term_};
    }
  }
  if (mark_.sequence == tried_) {
    return;
  }
  tried_ = mark_.sequence;
  try {
    mark_.Write(shipped_.path);
  } catch (const std::runtime_error&) {  // a full disk: a start before the next mark takes longer
  }
}

void JournalShipper::ShipEvents() {
  JournalState& at = shipped_.state;
  if (at.num_bytes >= wanted_bytes_) {
    return PassTerms();
  }
  const OpenJournal journal(shipped_.path);
  LogScan scan(journal.fd, at.num_bytes, wanted_bytes_);
  for (const int64_t end = at.num_bytes + kPieceBytes; at.num_bytes < end;) {
    const auto piece = scan.Next();
    if (!piece || (!IsOfFile(*piece) && !ShipEvent(*piece))) {
      return;
    }
    at = piece->kind == LogPiece::Kind::kEvent
             ? JournalState{piece->end(), piece->offset, EventChecksum(piece->whole)}
             : JournalState{piece->end(), at.last_event_offset, at.last_event_crc32};
  }
}

}  // namespace pangea
