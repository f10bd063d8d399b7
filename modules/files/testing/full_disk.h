#pragma once

#include <sys/resource.h>

#include <csignal>
#include <cstdint>

namespace pangea {

// The disk is full as long as this object lives: no file of this process grows beyond `file_bytes`
// (the error is EFBIG instead of ENOSPC).
class FullDisk {
 public:
  explicit FullDisk(uint64_t file_bytes) {
    std::signal(SIGXFSZ, SIG_IGN);
    getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit full{file_bytes, before_.rlim_max};
    setrlimit(RLIMIT_FSIZE, &full);
  }
  ~FullDisk() { setrlimit(RLIMIT_FSIZE, &before_); }
  FullDisk(const FullDisk&) = delete;
  FullDisk& operator=(const FullDisk&) = delete;

 private:
  rlimit before_{};
};

}  // namespace pangea
