#pragma once

// A file without a name for what a run sets aside, gone when the run is, however it ends. It lies
// in $TMPDIR, else /var/tmp, which unlike /tmp is on a disk.

#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "core/record_store.h"

namespace pangea {

struct ScratchFileOptions {
  std::string folder;                  // empty: as above
  int64_t max_bytes = 20'000'000'000;  // some 700,000 keyframes
};

class ScratchFile : public RecordStore {
 public:
  // Throws std::runtime_error naming the folder when there can be no file.
  explicit ScratchFile(const ScratchFileOptions& options = {});
  ~ScratchFile() override;
  ScratchFile(const ScratchFile&) = delete;
  ScratchFile& operator=(const ScratchFile&) = delete;

  // Tried anew each time: a disk that was full may have room again.
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
