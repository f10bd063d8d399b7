#pragma once

// The view of an agent's camera at its newest keyframe: the tracked corners, with their pixels in
// the keyframes before, and the image if the agent publishes images. A keyframe comes seconds after
// its image, so images wait here for their keyframe; bounded, the oldest are dropped first.

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

// The corners of one keyframe that are tracked landmarks.
struct ShownCorners {
  MapId map;
  int32_t seq = 0;
  int64_t utime = 0;
  int width = 0;  // of the image, pixels
  int height = 0;
  std::map<int32_t, Eigen::Vector2f> pixels;  // raw, by landmark id
};

class AgentView {
 public:
  static constexpr size_t kMaxImages = 300;
  static constexpr size_t kMaxImageBytes = 30'000'000;
  static constexpr size_t kTrail = 8;  // keyframes
  // A keyframe's time may differ from its image's by the read-out of a rolling shutter.
  static constexpr int64_t kSameTime_us = 40'000;

  void Take(ShownCorners corners);
  void Take(std::shared_ptr<const ShownImage> image);

  // A number that changes whenever the view changes; 0: there is nothing to see yet.
  int64_t number() const { return number_; }
  int width() const { return width_; }
  int height() const { return height_; }
  // The pixels of each track, newest first.
  std::vector<std::vector<Eigen::Vector2f>> Tracks() const;
  // The image of the newest keyframe, or the newest image while there is no keyframe; may be null.
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
