#pragma once

#include <filesystem>

namespace pangea {

// A folder that somebody named, and those above it. Throws std::runtime_error with its path and the
// cause.
void MakeFolder(const std::filesystem::path& path);

// As its name: without the slash that a shell completes it with.
std::filesystem::path WithoutSlash(const std::filesystem::path& folder);

}  // namespace pangea
