#pragma once

// The anchor messages on an agent's bus, for the report.

#include <cstdint>
#include <map>
#include <memory>
#include <vector>

#include "core/anchor.h"
#include "log_file/log_reader.h"

namespace pangea {

// The anchors shown together with one pose, while the odometry tracked.
struct AnchorFrame {
  int64_t utime = 0;      // of the image, sensor clock
  int64_t log_utime = 0;  // capture time, wall clock
  MapId map;
  Rigid3 T_odom_body;
  std::shared_ptr<const ShownAnchors> shown;  // the newest one before the pose
};

// An ANCHOR_k message: the pose of an anchor, without blending.
struct HeardAnchor {
  int64_t log_utime = 0;
  int64_t revision = 0;
  bool gone = false;
  MapId map;
  Rigid3 T_odom_anchor;
};

struct AnchorTrack {
  std::vector<AnchorFrame> frames;                     // from the first SHOWN_ANCHORS_k on
  std::map<AnchorId, std::vector<HeardAnchor>> heard;  // by anchor, in the order of the log
  std::map<AnchorId, AnchorEdit> requests;             // newest request by anchor
};

// Reads the log of one agent's bus, event by event.
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

}  // namespace pangea
