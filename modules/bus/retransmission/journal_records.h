#pragma once

// A RecordStore in front of another one: the record of a keyframe that comes from the journal's
// file is not written a second time, but made anew of its event there when it is read. So it also
// stands in a checkpoint by its place alone. What comes over the bus goes to the other store.

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
  // The process' record of a keyframe.
  using Encoder = std::function<std::vector<uint8_t>(const Keyframe&)>;

  // `others` may be null: what comes over the bus finds no room then.
  JournalRecords(std::shared_ptr<RecordStore> others, Encoder encoder)
      : others_(std::move(others)), encoder_(std::move(encoder)) {}
  ~JournalRecords() override;
  JournalRecords(const JournalRecords&) = delete;
  JournalRecords& operator=(const JournalRecords&) = delete;

  // The journal's file: as it is now, also if another one gets its name. Throws std::runtime_error.
  void Open(const std::string& path);
  // What is appended from now on is of the keyframe of this event of the file; nothing: it is not.
  void SetEvent(std::optional<int64_t> offset) { event_ = offset; }

  std::optional<int64_t> Append(std::span<const uint8_t> record) override;
  bool Read(int64_t offset, std::span<uint8_t> record) override;
  std::string problem() const override;

 private:
  // An offset from here on is one in the journal.
  static constexpr int64_t kJournal = int64_t{1} << 62;

  std::shared_ptr<RecordStore> others_;
  const Encoder encoder_;
  int fd_ = -1;
  std::optional<int64_t> event_;
  std::string problem_;
};

}  // namespace pangea
