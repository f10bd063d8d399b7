#pragma once

// The anchors at the end of a log: ANCHOR has their poses, ANCHOR_EDIT their edits and editors. A
// journal (journal.lcm) has only edits; a replay of it has both.

#include <map>
#include <optional>
#include <string>

#include "core/anchor.h"
#include "log_file/log_reading.h"

namespace pangea {

struct LoggedAnchor {
  int64_t revision = 0;
  int32_t edited_by = 0;
  bool deleted = false;
  std::string name;
  std::string payload;
  std::optional<AnchorState> state;  // empty: the log does not contain its pose
  std::optional<AnchorEdit> place;   // the newest edit with a placement, if the log has one
};

struct LoggedAnchors {
  std::map<AnchorId, LoggedAnchor> anchors;
  int64_t num_edits = 0, num_states = 0;  // messages
  int64_t num_refused = 0;                // invalid messages, and edits that were refused

  // Whether the log has edits but no poses of anchors.
  bool edits_only() const { return num_edits > 0 && num_states == 0; }
};

// Damaged parts of the log are reported in `readings` (log_reader.h). Throws std::runtime_error if
// it cannot be opened or is not a log. Edits that the server refuses are in the log too: those that
// make more anchors than its option allows (OPTIONS_anchors) are refused here as well.
LoggedAnchors ReadAnchors(const std::string& log, LogReadings* readings = nullptr);

// Standard deviation of the position, metres: root mean square over its axes.
double RmsPositionSigma(const AnchorState& state);

// A table for people, with a remark if the log, named `log`, has only edits.
std::string ToText(const LoggedAnchors& logged, const std::string& log);
// All fields of all anchors. Poses: T_map_anchor in the frame of `map` (z up), quaternion w x y z.
std::string ToJson(const LoggedAnchors& logged);

}  // namespace pangea
