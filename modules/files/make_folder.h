#pragma once

#include <filesystem>

namespace pangea {

// Makes the folder and its parents if they do not exist. Throws std::runtime_error with the path
// and the cause.
void MakeFolder(const std::filesystem::path& path);

// The folder's path without a trailing slash, such as a shell's completion adds, or a trailing dot.
std::filesystem::path WithoutSlash(const std::filesystem::path& folder);

}  // namespace pangea
