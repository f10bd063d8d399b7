#pragma once

// The site's folder of uploaded recordings: recordings/<time>_agent_<id>.zip. An upload under way
// is recordings/agent_<id>.part; it is removed if it is aborted, and when the gateway starts.
// Bounded: the size of all files together, and kLeftOnDisk stays free on the disk.

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>

#include "gateway/recording/recording_socket.h"

namespace pangea {

class RecordingFolder : public RecordingStore {
 public:
  static constexpr int64_t kLeftOnDisk = 1'000'000'000;  // bytes

  // `max_bytes`: bound for all files in the folder. Throws std::filesystem::filesystem_error.
  RecordingFolder(std::filesystem::path folder, int64_t max_bytes);
  ~RecordingFolder() override;
  RecordingFolder(const RecordingFolder&) = delete;
  RecordingFolder& operator=(const RecordingFolder&) = delete;

  std::string Begin(int32_t agent_id, int64_t bytes) override;
  std::string Write(int32_t agent_id, Bytes data) override;
  Kept Finish(int32_t agent_id) override;
  void Abort(int32_t agent_id) override;

 private:
  struct Upload {
    int fd = -1;
    int64_t bytes = 0;  // size of the finished file
    int64_t written = 0;
    int64_t on_its_way = 0;  // bytes whose way to the disk has begun
  };
  static void StartWriteBack(Upload* upload);
  std::filesystem::path PartOf(int32_t agent_id) const;
  std::filesystem::path NewName(int32_t agent_id) const;
  bool HasRoomFor(int64_t bytes) const;

  const std::filesystem::path folder_;
  const int64_t max_bytes_;
  std::map<int32_t, Upload> uploads_;
};

}  // namespace pangea
