#pragma once

// Caches the latest windows: neighbouring candidates share windows, and the steps of one candidate
// need the same one twice. A window depends only on its keyframes and the options. Not thread safe.

#include <cstddef>
#include <memory>
#include <utility>

#include "core/recent_cache.h"
#include "loop_verification/window.h"

namespace pangea {

class WindowCache {
 public:
  // Like MakeWindow; all calls must have the same options.
  std::shared_ptr<const Window> Make(const KeyframeWindow& frames, const WindowOptions& options,
                                     const KeyframeWindow& after = {}) {
    const std::pair key(frames, after);
    auto window = windows_.Find(key);
    if (window == nullptr) {
      window = std::make_shared<const Window>(MakeWindow(frames, options, after));
      windows_.Add(key, window);
    }
    return window;
  }

 private:
  static constexpr size_t kMaxWindows = 64;  // some 50 kB each

  // Keyed by the keyframe views; an entry keeps them alive.
  RecentCache<std::pair<KeyframeWindow, KeyframeWindow>, Window> windows_{kMaxWindows};
};

}  // namespace pangea
