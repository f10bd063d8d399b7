#pragma once

// A RecordStore in front of another one. A keyframe from the journal's file is not stored a second
// time: its record is made again from the event in the file whenever it is read. So a checkpoint
// needs only the event's offset. Records of keyframes from the bus go to the other store.

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/keyframe.h"
#include "core/record_store.h"

namespace pangea {

class JournalRecords : public RecordStore {
 public:
  // Makes the process' record of a keyframe.
  using Encoder = std::function<std::vector<uint8_t>(const Keyframe&)>;

  // `others` may be null; then keyframes from the bus find no room.
  JournalRecords(std::shared_ptr<RecordStore> others, Encoder encoder)
      : others_(std::move(others)), encoder_(std::move(encoder)) {}
  ~JournalRecords() override;
  JournalRecords(const JournalRecords&) = delete;
  JournalRecords& operator=(const JournalRecords&) = delete;

  // Opens the journal's file and keeps it open, even if another file gets its name. Throws
  // std::runtime_error when it cannot be opened.
  void Open(const std::string& path);
  // Offset of the event from which the next appended records come; nothing: they are not from the
  // file.
  void SetEvent(std::optional<int64_t> offset) { event_ = offset; }

  std::optional<int64_t> Append(std::span<const uint8_t> record) override;
  bool Read(int64_t offset, std::span<uint8_t> record) override;
  std::string problem() const override;

 private:
  // Offsets of records from here on are kJournal + the event's offset in the journal's file.
  static constexpr int64_t kJournal = int64_t{1} << 62;

  std::shared_ptr<RecordStore> others_;
  const Encoder encoder_;
  int fd_ = -1;
  std::optional<int64_t> event_;
  std::string problem_;
};

}  // namespace pangea
