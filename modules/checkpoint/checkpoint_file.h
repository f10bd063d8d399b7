#pragma once

// A checkpoint file: it keeps a process' state after reading the journal up to some point, so that
// its next start reads only the rest of the journal. The journal remains the only truth: a
// checkpoint that is missing, torn, damaged, or of another version, other options or another
// journal is not used, and is written anew.
//
// The file has a head (CheckpointKey, and the JournalState up to which the journal was read), the
// process' own bytes, then the number of all these bytes and their CRC-32. It is written under a
// temporary name and renamed once it is on the disk; so if the process is killed, or the disk is
// full, the former checkpoint remains. Values are as in this machine's memory
// (core/byte_record.h). Not thread safe.

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "core/byte_record.h"
#include "messages/catch_up_messages.h"

namespace pangea {

// A checkpoint is used only if its key is equal to that of the process which reads it.
struct CheckpointKey {
  std::string process;  // its name on the bus, e.g. "posegraph"
  uint32_t format = 0;  // version of the process' own bytes; increased when their meaning changes
  std::string options;  // the options on which the state depends
};

class CheckpointWriter final : public ByteWriter {
 public:
  // Makes the folder if it does not exist. This and all other functions throw std::runtime_error,
  // with the file's name, when the file cannot be written.
  CheckpointWriter(const std::filesystem::path& file, const CheckpointKey& key,
                   const JournalState& journal);
  // Without Commit, the temporary file is removed.
  ~CheckpointWriter() override;
  CheckpointWriter(const CheckpointWriter&) = delete;
  CheckpointWriter& operator=(const CheckpointWriter&) = delete;

  // Returns when the file has its final name and is on the disk.
  void Commit();

 protected:
  void PutBytes(const void* data, size_t size) override;

 private:
  void Flush();
  [[noreturn]] void Fail() const;

  const std::filesystem::path file_;
  const std::filesystem::path made_;  // the temporary name until Commit
  int fd_ = -1;
  int64_t num_bytes_ = 0;
  std::vector<uint8_t> buffer_;
  uint32_t crc32_ = 0;  // of the first num_bytes_ bytes
};

// The head of a checkpoint.
struct CheckpointHead {
  CheckpointKey key;
  JournalState journal;
};

class CheckpointReader final : public ByteReader {
 public:
  // Opens a checkpoint and reads it once to verify its checksum. Throws std::runtime_error with the
  // reason when it cannot be used.
  CheckpointReader(const std::filesystem::path& file, const CheckpointKey& key);
  // The same, but accepts any key: those of any process, format and options.
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
  int64_t at_ = 0;   // offset of the next byte to read
  int64_t end_ = 0;  // offset behind the process' bytes
  std::vector<uint8_t> buffer_;
  int64_t buffer_at_ = 0;  // offset of the buffer's first byte in the file
  CheckpointHead head_;
};

}  // namespace pangea
