#pragma once

// Writes a new journal with checksums, as the agent_handler does.

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>

#include "agent_handler/journal/journal.h"

namespace pangea::site {

class JournalWriter {
 public:
  // Throws std::runtime_error if the file exists or cannot be created.
  explicit JournalWriter(const std::filesystem::path& path);

  // Throws std::runtime_error if writing fails.
  void Write(int64_t utime, const std::string& channel, Bytes data);
  // Flushes everything to the disk; throws std::runtime_error if that fails.
  void Finish();
  int64_t count() const { return count_; }

 private:
  const std::filesystem::path path_;
  std::unique_ptr<Journal> journal_;
  int64_t count_ = 0;
};

}  // namespace pangea::site
