#pragma once

// The anchors of a log, as it ends: ANCHOR says where they are, ANCHOR_EDIT who made them what. A
// journal (journal.lcm) has edits alone; a replay of it has both.

#include <map>
#include <optional>
#include <string>

#include "core/anchor.h"
#include "log_file/log_reading.h"

namespace pangea::session {

struct LoggedAnchor {
  int64_t revision = 0;
  int32_t edited_by = 0;
  bool deleted = false;
  std::string name;
  std::string payload;
  std::optional<AnchorState> state;  // none: the log does not say where it is
  std::optional<AnchorEdit> place;   // the newest edit that says where it is, if the log has one
};

struct LoggedAnchors {
  std::map<AnchorId, LoggedAnchor> anchors;
  int64_t num_edits = 0, num_states = 0;  // messages
  int64_t num_refused = 0;                // messages that make no sense, edits against their right

  // Edits, and nothing of where they put anchors.
  bool edits_only() const { return num_edits > 0 && num_states == 0; }
};

// What of the log is lost is noted in `readings` (log_reader.h). Throws std::runtime_error when it
// cannot be opened or is none.
LoggedAnchors ReadAnchors(const std::string& log, LogReadings* readings = nullptr);

// Standard deviation of the position, metres: root mean square over its axes.
double PositionSigma(const AnchorState& state);

// A table for people; a line more when the log, named `log`, has edits only.
std::string ToText(const LoggedAnchors& logged, const std::string& log);
// Every field of each. Poses: T_map_anchor in the frame of `map` (z up), quaternion w x y z.
std::string ToJson(const LoggedAnchors& logged);

}  // namespace pangea::session
