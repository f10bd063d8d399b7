#pragma once

// A cache of noise-free frames on disk: one folder per (scene, path, camera, optics), one PNG per
// stamp. The files can be deleted at any time; several programs may share them.

#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <string>

namespace pangea::sim {

class FrameCache {
 public:
  // If `root` is empty, or no folder can be made there, nothing is cached.
  FrameCache(const std::string& root, uint64_t key);

  // Empty if the frame is not cached, or not as it was stored.
  cv::Mat Load(int64_t stamp_ns, cv::Size size) const;
  // Failures (a full disk) are ignored: the cache only saves time.
  void Store(int64_t stamp_ns, const cv::Mat& frame) const;

 private:
  std::string PathOf(int64_t stamp_ns) const;
  std::string folder_;
};

// ${XDG_CACHE_HOME:-~/.cache}/pangea/frames; empty without either variable.
std::string DefaultCacheRoot();

}  // namespace pangea::sim
