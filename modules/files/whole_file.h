#pragma once

// Files that appear under their names whole, and on the disk, or not at all: also when the process
// is killed or the power goes meanwhile.

#include <sys/types.h>

#include <filesystem>
#include <string_view>

namespace pangea {

// All that was written to the file or folder is on the disk when this returns. Throws
// std::runtime_error.
void SyncToDisk(const std::filesystem::path& path);

inline constexpr mode_t kOwnerOnly = 0600;  // of keys, invites, images of people

// A new file with this mode. False, and nothing is changed, if there is one of that name. Throws
// std::runtime_error when it cannot be written.
bool WriteNewFile(const std::filesystem::path& file, std::string_view text, mode_t mode);
// ... or in place of one that is there.
void ReplaceFile(const std::filesystem::path& file, std::string_view text, mode_t mode);

// False if there was none: of several who remove a file, one is told true. Throws
// std::runtime_error when it cannot be removed.
bool RemoveFile(const std::filesystem::path& file);

}  // namespace pangea
