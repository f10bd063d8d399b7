#pragma once

// Windows made last: neighbouring candidates share them, and the steps of one ask twice. A window
// depends on nothing but its keyframes and the options. Not thread safe.

#include <cstddef>
#include <memory>
#include <utility>

#include "core/recent_cache.h"
#include "loop_verification/window.h"

namespace pangea {

class WindowCache {
 public:
  // As MakeWindow, always with the same options.
  Window Make(const KeyframeWindow& frames, const WindowOptions& options,
              const KeyframeWindow& after = {}) {
    const std::pair key(frames, after);
    auto window = windows_.Find(key);
    if (window == nullptr) {
      window = std::make_shared<const Window>(MakeWindow(frames, options, after));
      windows_.Add(key, window);
    }
    return *window;
  }

 private:
  static constexpr size_t kMaxWindows = 64;  // some 50 kB each

  // By the views themselves, which an entry keeps alive.
  RecentCache<std::pair<KeyframeWindow, KeyframeWindow>, Window> windows_{kMaxWindows};
};

}  // namespace pangea
