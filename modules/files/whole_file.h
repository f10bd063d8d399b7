#pragma once

// Atomic writing of files: the file appears under its name whole, and safe on the disk, or not at
// all, even if the process is killed or the power fails.

#include <sys/types.h>

#include <filesystem>
#include <string_view>

namespace pangea {

inline constexpr mode_t kOwnerOnly = 0600;  // for keys, invites, images of people

// Writes a new file with this mode. False, and nothing is changed, if the name exists already.
// Throws std::runtime_error when it cannot be written.
bool WriteNewFile(const std::filesystem::path& file, std::string_view text, mode_t mode);
// The same, but replaces a file that exists already.
void ReplaceFile(const std::filesystem::path& file, std::string_view text, mode_t mode);

// Removes a file. False if there is none: of several processes that remove the same file, exactly
// one gets true. Throws std::runtime_error when it cannot be removed.
bool RemoveFile(const std::filesystem::path& file);

}  // namespace pangea
