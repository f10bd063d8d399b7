#pragma once

// What a report needs of the anchors on an agent's bus.

#include <cstdint>
#include <map>
#include <memory>
#include <vector>

#include "core/anchor.h"
#include "log_file/log_reader.h"

namespace pangea::session {

// What was shown with one pose, while the odometry tracked.
struct AnchorFrame {
  int64_t utime = 0;      // of the image, sensor clock
  int64_t log_utime = 0;  // when it was captured, wall clock
  MapId map;
  Rigid3 T_odom_body;
  std::shared_ptr<const ShownAnchors> shown;  // the newest before it
};

// ANCHOR_k: where an anchor is, unblended.
struct HeardAnchor {
  int64_t log_utime = 0;
  int64_t revision = 0;
  bool gone = false;
  MapId map;
  Rigid3 T_odom_anchor;
};

struct AnchorTrack {
  std::vector<AnchorFrame> frames;                     // from the first SHOWN_ANCHORS_k on
  std::map<AnchorId, std::vector<HeardAnchor>> heard;  // each in the order of the log
  std::map<AnchorId, AnchorEdit> requests;             // the newest of each
};

// Of the log of one agent's bus, event by event.
class AnchorTrackReader {
 public:
  explicit AnchorTrackReader(int32_t agent_id);
  void Add(const LogEvent& event);
  AnchorTrack Take() { return std::move(track_); }

 private:
  void AddFrame(const LogEvent& event);

  const std::string pose_, shown_channel_, anchor_, request_;
  std::shared_ptr<const ShownAnchors> shown_;
  AnchorTrack track_;
};

}  // namespace pangea::session
