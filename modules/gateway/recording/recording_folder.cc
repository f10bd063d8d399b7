#include "gateway/recording/recording_folder.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <exception>
#include <utility>

#include "files/disk_io.h"
#include "files/whole_file.h"
#include "site/site.h"

namespace pangea {
namespace {

namespace fs = std::filesystem;

constexpr const char* kPart = ".part";
constexpr int64_t kWriteBackEvery = 4'000'000;  // bytes
constexpr const char* kCannotWrite = "the server cannot write it: tell whoever runs it";

}  // namespace

RecordingFolder::RecordingFolder(fs::path folder, int64_t max_bytes)
    : folder_(std::move(folder)), max_bytes_(max_bytes) {
  fs::create_directories(folder_);
  fs::permissions(folder_, fs::perms::owner_all);
  for (const auto& entry : fs::directory_iterator(folder_)) {
    if (entry.path().extension() == kPart) {
      fs::remove(entry.path());
    }
  }
}

RecordingFolder::~RecordingFolder() {
  while (!uploads_.empty()) {
    Abort(uploads_.begin()->first);
  }
}

fs::path RecordingFolder::PartOf(int32_t agent_id) const {
  return folder_ / fmt::format("agent_{}{}", agent_id, kPart);
}

fs::path RecordingFolder::NewName(int32_t agent_id) const {
  const std::string name = fmt::format("{}_agent_{}", site::TimeForFileName(), agent_id);
  fs::path file = folder_ / (name + ".zip");
  for (int n = 2; fs::exists(file); ++n) {
    file = folder_ / fmt::format("{}_{}.zip", name, n);
  }
  return file;
}

// Whether there is room for `bytes` and for the full size of all uploads that are under way.
bool RecordingFolder::HasRoomFor(int64_t bytes) const {
  int64_t under_way = bytes;
  int64_t unwritten = bytes;
  for (const auto& [agent_id, upload] : uploads_) {
    under_way += upload.bytes;
    unwritten += upload.bytes - upload.written;
  }
  int64_t kept = 0;
  constexpr auto kReadable = fs::directory_options::skip_permission_denied;
  for (const auto& entry : fs::recursive_directory_iterator(folder_, kReadable)) {
    if (entry.is_regular_file() && entry.path().extension() != kPart) {
      kept += static_cast<int64_t>(entry.file_size());
    }
  }
  return kept + under_way <= max_bytes_ &&
         static_cast<int64_t>(fs::space(folder_).available) - unwritten >= kLeftOnDisk;
}

std::string RecordingFolder::Begin(int32_t agent_id, int64_t bytes) {
  Abort(agent_id);
  try {
    if (!HasRoomFor(bytes)) {
      return "the server has no room for more recordings";
    }
  } catch (const std::exception&) {
    return kCannotWrite;
  }
  const int fd =
      open(PartOf(agent_id).c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, kOwnerOnly);
  if (fd < 0) {
    return kCannotWrite;
  }
  uploads_[agent_id] = {.fd = fd, .bytes = bytes};
  return "";
}

std::string RecordingFolder::Write(int32_t agent_id, Bytes data) {
  Upload& upload = uploads_.at(agent_id);
  const bool written = WriteFully(upload.fd, upload.written, data.data(), data.size());
  upload.written += static_cast<int64_t>(data.size());
  StartWriteBack(&upload);
  return written ? "" : kCannotWrite;
}

// The kernel would keep hundreds of megabytes in memory, and Finish would wait for them, with the
// links of all agents. This does not wait, and does not fail: Finish sees errors.
void RecordingFolder::StartWriteBack(Upload* upload) {
  if (upload->written - upload->on_its_way >= kWriteBackEvery) {
    sync_file_range(upload->fd, upload->on_its_way, upload->written - upload->on_its_way,
                    SYNC_FILE_RANGE_WRITE);
    upload->on_its_way = upload->written;
  }
}

RecordingStore::Kept RecordingFolder::Finish(int32_t agent_id) {
  const auto upload = uploads_.extract(agent_id);
  close(upload.mapped().fd);
  try {
    SyncToDisk(PartOf(agent_id));
    const fs::path file = NewName(agent_id);
    fs::rename(PartOf(agent_id), file);
    SyncToDisk(folder_);
    return {file.filename().string(), ""};
  } catch (const std::exception&) {
    std::error_code ignored;
    fs::remove(PartOf(agent_id), ignored);
    return {"", kCannotWrite};
  }
}

void RecordingFolder::Abort(int32_t agent_id) {
  if (const auto upload = uploads_.extract(agent_id); !upload.empty()) {
    close(upload.mapped().fd);
    std::error_code ignored;
    fs::remove(PartOf(agent_id), ignored);
  }
}

}  // namespace pangea
