#include "viewer/scene/agent_view.h"

#include <cstdlib>
#include <utility>

namespace pangea::viewer {
void AgentView::Take(ShownCorners corners) {
  const bool other_map = !corners_.empty() && corners_.front().map != corners.map;
  if (!corners_.empty() &&
      (other_map ? corners.map < corners_.front().map : corners.seq <= corners_.front().seq)) {
    return;  // an old keyframe that was sent again, or one of an earlier map
  }
  if (other_map) {
    corners_.clear();
  }
  image_.reset();
  while (!waiting_.empty() && waiting_.front()->utime <= corners.utime + kSameTime_us) {
    if (std::abs(waiting_.front()->utime - corners.utime) <= kSameTime_us) {
      image_ = waiting_.front();
    }
    waiting_bytes_ -= waiting_.front()->bytes.size();
    waiting_.pop_front();
  }
  width_ = corners.width;
  height_ = corners.height;
  corners_.push_front(std::move(corners));
  if (corners_.size() > kTrail) {
    corners_.pop_back();
  }
  ++number_;
}

void AgentView::Take(std::shared_ptr<const ShownImage> image) {
  if (corners_.empty()) {
    image_ = image;
    width_ = image->width;
    height_ = image->height;
    ++number_;
  }
  waiting_bytes_ += image->bytes.size();
  waiting_.push_back(std::move(image));
  while (waiting_.size() > kMaxImages || waiting_bytes_ > kMaxImageBytes) {
    waiting_bytes_ -= waiting_.front()->bytes.size();
    waiting_.pop_front();
  }
}

std::vector<std::vector<Eigen::Vector2f>> AgentView::Tracks() const {
  std::vector<std::vector<Eigen::Vector2f>> tracks;
  if (corners_.empty()) {
    return tracks;
  }
  for (const auto& [landmark, newest] : corners_.front().pixels) {
    std::vector<Eigen::Vector2f>& track = tracks.emplace_back();
    for (const ShownCorners& corners : corners_) {
      const auto seen = corners.pixels.find(landmark);
      if (seen == corners.pixels.end()) {
        break;
      }
      track.push_back(seen->second);
    }
  }
  return tracks;
}

}  // namespace pangea::viewer
