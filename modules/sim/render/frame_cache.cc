#include "sim/render/frame_cache.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <opencv2/imgcodecs.hpp>

#include "recording/grey_image.h"

namespace pangea::sim {

namespace fs = std::filesystem;

FrameCache::FrameCache(const std::string& root, uint64_t key) {
  if (!root.empty()) {
    folder_ = fmt::format("{}/{:016x}", root, key);
    std::error_code error;
    fs::create_directories(folder_, error);
    if (error) {
      folder_.clear();
    }
  }
}

std::string FrameCache::PathOf(int64_t stamp_ns) const {
  return fmt::format("{}/{}.png", folder_, stamp_ns);
}

cv::Mat FrameCache::Load(int64_t stamp_ns, cv::Size size) const {
  return folder_.empty() ? cv::Mat() : ReadGrey(PathOf(stamp_ns), size).pixels;
}

void FrameCache::Store(int64_t stamp_ns, const cv::Mat& frame) const {
  if (folder_.empty()) {
    return;
  }
  // Write with another name first, so that a reader never sees an incomplete file.
  const std::string partial = fmt::format("{}/{}.{}.partial.png", folder_, stamp_ns, getpid());
  std::error_code error;
  if (cv::imwrite(partial, frame, {cv::IMWRITE_PNG_COMPRESSION, 1})) {
    fs::rename(partial, PathOf(stamp_ns), error);
  }
}

std::string DefaultCacheRoot() {
  // Read once, before threads start.
  const char* xdg = std::getenv("XDG_CACHE_HOME");  // NOLINT(concurrency-mt-unsafe)
  const char* home = std::getenv("HOME");           // NOLINT(concurrency-mt-unsafe)
  if (xdg != nullptr && *xdg != '\0') {
    return std::string(xdg) + "/pangea/frames";
  }
  return home != nullptr ? std::string(home) + "/.cache/pangea/frames" : "";
}

}  // namespace pangea::sim
