#pragma once

// Reads the journal's events from its file, for a process on the agent_handler's host. It reads
// only the part that JOURNAL_FILE told of; what is appended later comes over the bus. The
// agent_handler checked each event's checksum when it opened the file.

#include <cstdint>
#include <functional>
#include <optional>
#include <stdexcept>
#include <string>

#include "log_file/log_scan.h"
#include "messages/catch_up_messages.h"

namespace pangea {

// The disk cannot be read.
class JournalUnreadable : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

class JournalReader {
 public:
  // Throws std::runtime_error with the reason when the file cannot be read, is not a regular file,
  // or is another journal.
  explicit JournalReader(const JournalFile& file);
  ~JournalReader();
  JournalReader(const JournalReader&) = delete;
  JournalReader& operator=(const JournalReader&) = delete;

  // Start reading behind `state`, which an earlier position() returned. Throws std::runtime_error
  // when this journal was never in that state.
  void StartBehind(const JournalState& state);

  // Returns whether it takes the event. If not, reading ends before this event.
  using Handler = std::function<bool(const std::string& channel, Bytes data, int64_t offset)>;
  // Gives the events of about the next kPieceBytes to the handler. False when no event is left or
  // one was not taken. Throws JournalUnreadable, and what the handler throws.
  bool Next(const Handler& handler);
  // Starts again at the beginning, or behind the state that StartBehind was given.
  void Rewind();

  int64_t bytes_left() const { return state_.num_bytes - at_; }
  // The state of the journal when it ended with the last event read. Throws std::runtime_error
  // when the disk cannot be read.
  JournalState position() const;

 private:
  static constexpr int64_t kPieceBytes = 250'000;

  // Throws std::runtime_error unless the file has the last event of `state` where `state` says.
  void Check(const JournalState& state) const;
  std::optional<LogPiece> NextPiece();

  int fd_ = -1;
  const JournalState state_;
  LogScan scan_;
  JournalState begin_;
  int64_t at_ = 0;
  int64_t last_event_offset_ = -1;  // before at_
};

// The state of a journal's file up to its last whole event, which works without an agent_handler.
// If the journal was once in the state `known`, it is read only from there on. Throws
// std::runtime_error when it cannot be read.
JournalState ReadJournalState(const std::string& path, const JournalState& known);

}  // namespace pangea
