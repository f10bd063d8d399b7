#include "files/make_folder.h"

#include <fmt/format.h>

#include <stdexcept>
#include <system_error>

namespace pangea {

void MakeFolder(const std::filesystem::path& path) {
  std::error_code error;
  std::filesystem::create_directories(path, error);
  if (error) {
    throw std::runtime_error(
        fmt::format("the folder {} cannot be made: {}", path.string(), error.message()));
  }
}

std::filesystem::path WithoutSlash(const std::filesystem::path& folder) {
  const std::filesystem::path normal = folder.lexically_normal();
  return normal.has_filename() ? normal : normal.parent_path();
}

}  // namespace pangea
