#include "recording/image_path.h"

#include <algorithm>
#include <filesystem>
#include <system_error>

namespace pangea {

namespace fs = std::filesystem;

std::string ImagePath(const std::string& mav0, const std::string& name) {
  const fs::path cam0 = fs::path(mav0) / "cam0";
  const fs::path as_in_euroc = cam0 / "data" / name;
  std::string slashes = name;
  std::ranges::replace(slashes, '\\', '/');
  for (const fs::path& path : {as_in_euroc, cam0 / "data" / slashes, cam0 / slashes,
                               fs::path(mav0) / slashes, fs::path(mav0) / ".." / slashes}) {
    std::error_code error;
    if (fs::is_regular_file(path, error)) {
      return path.lexically_normal().string();
    }
  }
  return as_in_euroc.string();
}

}  // namespace pangea
