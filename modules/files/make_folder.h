#pragma once

#include <filesystem>

namespace pangea {

// A folder that somebody named, and those above it. Throws std::runtime_error with its path and the
// cause.
void MakeFolder(const std::filesystem::path& path);

}  // namespace pangea
