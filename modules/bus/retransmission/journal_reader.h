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

  using Handler = std::function<void(const std::string& channel, Bytes data)>;
  // The events of the next kPieceBytes or so; false when there are none left. Throws
  // std::runtime_error when the disk refuses.
  bool Next(const Handler& handler);
  void Rewind();

  int64_t bytes_left() const { return state_.num_bytes - at_; }

 private:
  static constexpr int64_t kPieceBytes = 250'000;

  void Check() const;

  int fd_ = -1;
  const JournalState state_;
  LogScan scan_;
  int64_t at_ = 0;
};

}  // namespace pangea
