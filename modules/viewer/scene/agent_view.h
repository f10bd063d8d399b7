#pragma once

// What an agent's camera saw at its newest keyframe: the corners it tracks, with their way through
// the keyframes before, and the image where the agent publishes images. A keyframe comes seconds
// after its image, so images wait here for theirs; bounded, the oldest go first.

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <vector>

#include <Eigen/Core>

#include "core/ids.h"

namespace pangea::viewer {

struct ShownImage {
  int32_t agent_id = 0;
  int64_t utime = 0;    // sensor clock
  int8_t encoding = 0;  // image_t.ENCODING_*
  int width = 0;        // pixels
  int height = 0;
  std::vector<uint8_t> bytes;
};

// Corners of one keyframe that are tracked landmarks.
struct ShownCorners {
  MapId map;
  int32_t seq = 0;
  int64_t utime = 0;
  int width = 0;  // of the image, pixels
  int height = 0;
  std::map<int32_t, Eigen::Vector2f> pixels;  // by landmark
};

class AgentView {
 public:
  static constexpr size_t kMaxImages = 300;
  static constexpr size_t kMaxImageBytes = 30'000'000;
  static constexpr size_t kTrail = 8;  // keyframes
  // A keyframe's time is its image's, but for the read-out of a rolling shutter.
  static constexpr int64_t kSameTime_us = 40'000;

  void Take(ShownCorners corners);
  void Take(std::shared_ptr<const ShownImage> image);

  // Another number: something else is to be seen; 0: nothing yet.
  int64_t number() const { return number_; }
  int width() const { return width_; }
  int height() const { return height_; }
  // Each track's pixels, newest first.
  std::vector<std::vector<Eigen::Vector2f>> Tracks() const;
  // Of the newest keyframe, or the newest at all while there is no keyframe; may be null.
  const std::shared_ptr<const ShownImage>& image() const { return image_; }

 private:
  std::deque<ShownCorners> corners_;  // newest first
  std::deque<std::shared_ptr<const ShownImage>> waiting_;
  size_t waiting_bytes_ = 0;
  std::shared_ptr<const ShownImage> image_;
  int64_t number_ = 0;
  int width_ = 0;
  int height_ = 0;
};

}  // namespace pangea::viewer
