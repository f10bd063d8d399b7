#pragma once

// The file in which a process keeps what it made of the journal, so that its next start reads the
// journal's rest alone. The journal stays the truth: a checkpoint that is missing, torn, damaged,
// of another version, of other options or of another journal is not used, and is written anew.
//
// In it: what it is of (CheckpointKey), up to where in the journal (JournalState), and the process'
// own bytes; behind them their number and a checksum of it all. Written beside its place and
// renamed once it is on the disk: a process that is killed, or a disk that is full, leaves the one
// before. Bytes are as this machine has them in memory (core/byte_record.h). One thread.

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "core/byte_record.h"
#include "messages/catch_up_messages.h"

namespace pangea {

// What must agree.
struct CheckpointKey {
  std::string process;  // on the bus: "posegraph"
  uint32_t format = 0;  // of the process' bytes: counted on when these, or what they mean, change
  std::string options;  // that the state depends on
};

class CheckpointWriter final : public ByteWriter {
 public:
  // Throws std::runtime_error naming the file when the disk refuses; so does all that follows. The
  // folder is made if there is none.
  CheckpointWriter(const std::filesystem::path& file, const CheckpointKey& key,
                   const JournalState& journal);
  // What was not committed is removed.
  ~CheckpointWriter() override;
  CheckpointWriter(const CheckpointWriter&) = delete;
  CheckpointWriter& operator=(const CheckpointWriter&) = delete;

  // The file is under its name, and on the disk, when this returns.
  void Commit();

 protected:
  void PutBytes(const void* data, size_t size) override;

 private:
  void Flush();
  [[noreturn]] void Fail() const;

  const std::filesystem::path file_;
  const std::filesystem::path made_;  // what it is called until it is whole
  int fd_ = -1;
  int64_t num_bytes_ = 0;
  std::vector<uint8_t> buffer_;
  uint32_t crc32_ = 0;  // of these
};

// What a checkpoint is of.
struct CheckpointHead {
  CheckpointKey key;
  JournalState journal;
};

class CheckpointReader final : public ByteReader {
 public:
  // Has read all of it once when it returns: it is whole. Throws std::runtime_error that says why
  // it is not to be used.
  CheckpointReader(const std::filesystem::path& file, const CheckpointKey& key);
  // Of whatever process, format and options.
  explicit CheckpointReader(const std::filesystem::path& file);
  ~CheckpointReader() override;
  CheckpointReader(const CheckpointReader&) = delete;
  CheckpointReader& operator=(const CheckpointReader&) = delete;

  const CheckpointHead& head() const { return head_; }

 protected:
  size_t bytes_left() const override { return static_cast<size_t>(end_ - at_); }
  bool Read(void* data, size_t size) override;

 private:
  void CheckWhole();
  void ReadHead();

  int fd_ = -1;
  int64_t at_ = 0;   // what is read next
  int64_t end_ = 0;  // of the process' bytes
  std::vector<uint8_t> buffer_;
  int64_t buffer_at_ = 0;  // of its first byte in the file
  CheckpointHead head_;
};

}  // namespace pangea
