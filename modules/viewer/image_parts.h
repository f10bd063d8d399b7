#pragma once

// Joins images that come in chunks (image_t). Bounded: kMaxPending images per agent may lack a
// chunk (beyond that the oldest is dropped), and images above kMaxImageBytes are refused.

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "pangea/image_t.hpp"
#include "viewer/scene/agent_view.h"

namespace pangea::viewer {

class ImageParts {
 public:
  static constexpr size_t kMaxPending = 4;
  static constexpr int32_t kMaxImageBytes = 8'000'000;

  // Adds a chunk. Returns the image if no other chunk is missing. `refused` says why a chunk is not
  // valid.
  std::optional<ShownImage> Add(int32_t agent_id, const image_t& chunk, std::string* refused);

 private:
  struct Pending {
    ShownImage image;
    std::vector<bool> have;
    size_t missing = 0;
  };
  std::map<int32_t, std::map<int64_t, Pending>> pending_;  // by agent and time
};

}  // namespace pangea::viewer
