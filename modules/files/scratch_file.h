#pragma once

// A RecordStore in a file without a name, which disappears when the process ends, however it ends.
// The file is in $TMPDIR, or else in /var/tmp, which unlike /tmp is on a disk.

#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "core/record_store.h"

namespace pangea {

struct ScratchFileOptions {
  std::string folder;                  // empty: $TMPDIR or /var/tmp
  int64_t max_bytes = 20'000'000'000;  // about 700,000 keyframes
};

class ScratchFile : public RecordStore {
 public:
  // Throws std::runtime_error with the folder when no file can be made there.
  explicit ScratchFile(const ScratchFileOptions& options = {});
  ~ScratchFile() override;
  ScratchFile(const ScratchFile&) = delete;
  ScratchFile& operator=(const ScratchFile&) = delete;

  // A failure does not prevent later calls: a full disk may have room again.
  std::optional<int64_t> Append(std::span<const uint8_t> record) override;
  bool Read(int64_t offset, std::span<uint8_t> record) override;
  std::string problem() const override { return problem_; }

 private:
  std::string folder_;
  int64_t max_bytes_;
  int file_ = -1;
  int64_t end_ = 0;
  std::string problem_;
};

}  // namespace pangea
