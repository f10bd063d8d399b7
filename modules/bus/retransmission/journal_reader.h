#pragma once

// The journal's events from its file, for a process on the agent_handler's host. The file is only
// read: what is appended meanwhile, and what another program does to it, is no concern of what was
// said to be in it. Its owner has checked each event's checksum when it opened it.

#include <cstdint>
#include <functional>
#include <string>

#include "log_file/log_scan.h"
#include "messages/catch_up_messages.h"

namespace pangea {

class JournalReader {
 public:
  // Throws std::runtime_error that says why it cannot be read: it is not here, no file, or
  // another journal.
  explicit JournalReader(const JournalFile& file);
  ~JournalReader();
  JournalReader(const JournalReader&) = delete;
  JournalReader& operator=(const JournalReader&) = delete;

  // Reads only what comes after this state of the journal, which position() gave. Throws
  // std::runtime_error when this journal was never in that state.
  void StartBehind(const JournalState& state);

  // Whether it is taken; if not, it is what comes next.
  using Handler = std::function<bool(const std::string& channel, Bytes data, int64_t offset)>;
  // The events of the next kPieceBytes or so; false when there are none left, or one is not taken.
  // Throws std::runtime_error when the disk refuses.
  bool Next(const Handler& handler);
  void Rewind();

  int64_t bytes_left() const { return state_.num_bytes - at_; }
  // The state of the journal when it had no more than was read. Throws as Next.
  JournalState position() const;

 private:
  static constexpr int64_t kPieceBytes = 250'000;

  // Throws std::runtime_error if there is another event at its end.
  void Check(const JournalState& state) const;

  int fd_ = -1;
  const JournalState state_;
  LogScan scan_;
  JournalState begin_;
  int64_t at_ = 0;
  int64_t last_event_offset_ = -1;  // before at_
};

// The state of a journal that nobody may be writing: up to its last whole event. The part up to
// `known`, a state that it may have been in, is not read. Throws std::runtime_error when it cannot
// be read.
JournalState ReadJournalState(const std::string& path, const JournalState& known);

}  // namespace pangea
