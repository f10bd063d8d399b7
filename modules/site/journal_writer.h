#pragma once

// A new journal, written with its checksums as the agent_handler writes it.

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>

#include "agent_handler/journal/journal.h"

namespace pangea::site {

class JournalWriter {
 public:
  // Throws std::runtime_error: it exists, or cannot be made.
  explicit JournalWriter(const std::filesystem::path& path);

  // Throws std::runtime_error when the disk refuses.
  void Write(int64_t utime, const std::string& channel, Bytes data);
  // All is on the disk when it returns; throws the same.
  void Finish();
  int64_t count() const { return count_; }

 private:
  const std::filesystem::path path_;
  std::unique_ptr<Journal> journal_;
  int64_t count_ = 0;
};

}  // namespace pangea::site
