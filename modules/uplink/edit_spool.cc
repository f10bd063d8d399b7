#include "uplink/edit_spool.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <iostream>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "files/disk_io.h"
#include "log_file/checked_scan.h"
#include "log_file/checksums.h"
#include "log_file/damaged_copy.h"
#include "log_file/log_event.h"
#include "messages/anchor_messages.h"
#include "messages/channels.h"
#include "messages/encoding.h"

namespace pangea {
namespace {

namespace fs = std::filesystem;

constexpr char kEditPrefix[] = "anchor_";
constexpr char kEditSuffix[] = ".lcm";
constexpr char kMadeSuffix[] = ".lcm.new";  // of a file that is being written

}  // namespace

EditSpool::EditSpool(fs::path folder, int32_t agent_id)
    : folder_(std::move(folder)), channel_(channels::AnchorRequest(agent_id)) {}

fs::path EditSpool::File(const AnchorId& anchor) const {
  return folder_ /
         fmt::format("{}{}_{}{}", kEditPrefix, anchor.agent_id, anchor.created_utime, kEditSuffix);
}

std::vector<AnchorEdit> EditSpool::TakeLeft() {
  std::map<AnchorId, AnchorEdit> left;
  std::vector<fs::path> damaged, made;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder_, error)) {
    const std::string name = entry.path().filename().string();
    if (name.starts_with(kEditPrefix) && name.ends_with(kMadeSuffix)) {
      made.push_back(entry.path());  // by a run that was killed meanwhile
    }
    if (!name.starts_with(kEditPrefix) || !name.ends_with(kEditSuffix)) {
      continue;
    }
    if (auto edit = Read(entry.path())) {
      revisions_[edit->anchor] = edit->revision;
      const AnchorId anchor = edit->anchor;
      left[anchor] = *std::move(edit);
    } else {
      damaged.push_back(entry.path());
    }
  }
  for (const fs::path& file : damaged) {
    const std::string kept = DamagedName(file.string());
    fs::rename(file, kept, error);
    std::cerr << fmt::format("'{}' IS DAMAGED: an edit of an anchor is lost; kept as '{}'\n",
                             file.string(), kept);
  }
  for (const fs::path& file : made) {
    fs::remove(file, error);
  }
  std::vector<AnchorEdit> edits;
  for (auto& [anchor, edit] : left) {
    edits.push_back(std::move(edit));
  }
  return edits;
}

std::optional<AnchorEdit> EditSpool::Read(const fs::path& file) const {
  const int fd = open(file.c_str(), O_RDONLY | O_CLOEXEC);
  if (fd < 0) {
    return std::nullopt;
  }
  std::optional<AnchorEdit> edit;
  bool is_ours = true;
  try {
    CheckedScan scan(fd);
    const CheckedScan::Piece* const piece = scan.Next();
    anchor_edit_t message{};
    if (piece != nullptr && piece->kind == LogPiece::Kind::kEvent &&
        DecodeMessage(piece->data, &message)) {
      edit = Parse(message).value;
      is_ours = piece->channel == channel_;
    }
  } catch (const std::runtime_error&) {
    // The disk cannot read it: it counts as damaged.
  }
  close(fd);
  if (!is_ours) {
    throw std::runtime_error(fmt::format(
        "'{}' is an edit of another agent: give each uplink its own --spool", file.string()));
  }
  return edit;
}

void EditSpool::Put(const AnchorEdit& edit) {
  refuses_ = !Write(edit);
  if (!refuses_) {
    revisions_[edit.anchor] = edit.revision;
    folder_unsynced_ = true;
  }
}

bool EditSpool::Write(const AnchorEdit& edit) const {
  std::vector<uint8_t> bytes;
  const std::vector<uint8_t> message = EncodeMessage(ToMessage(edit));
  AppendLogEvent(0, edit.anchor.created_utime, channel_, message, &bytes);
  AppendChecksumsEvent({0, {EventChecksum(bytes)}}, edit.anchor.created_utime, &bytes);
  const fs::path file = File(edit.anchor);
  const std::string made = fs::path(file).replace_extension(kMadeSuffix).string();
  const int fd = open(made.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
  if (fd < 0) {
    return false;
  }
  // On the disk before it takes the place of an earlier edit that is there.
  const bool written = WriteFully(fd, 0, bytes.data(), bytes.size()) && fdatasync(fd) == 0;
  const bool closed = close(fd) == 0;
  std::error_code error;
  if (written && closed) {
    fs::rename(made, file, error);
    return !error;
  }
  fs::remove(made, error);
  return false;
}

void EditSpool::Remove(const AnchorId& anchor, int64_t revision) {
  const auto kept = revisions_.find(anchor);
  if (kept != revisions_.end() && kept->second <= revision) {
    std::error_code error;
    fs::remove(File(anchor), error);
    revisions_.erase(kept);
  }
}

void EditSpool::Sync() {
  if (std::exchange(folder_unsynced_, false)) {
    TrySyncToDisk(folder_);
  }
}

}  // namespace pangea
