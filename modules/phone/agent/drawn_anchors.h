#pragma once

// The agent's anchors as an app draws them: their names and payloads from ANCHOR_k, and their
// current poses from SHOWN_ANCHORS_k.

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/anchor.h"

namespace pangea::phone {

struct DrawnAnchor {
  AnchorId id;
  std::string name;
  std::string payload;
  Rigid3 T_odom_anchor;
  double sigma_m = 0;  // standard deviation of the position along its least certain direction
  int64_t revision = 0;
};

class DrawnAnchors {
 public:
  void Take(const AnchorState& state);
  // The anchors of `shown` whose state is known.
  std::vector<DrawnAnchor> Draw(const ShownAnchors& shown) const;
  const AnchorState* Find(const AnchorId& id) const;

 private:
  std::map<AnchorId, AnchorState> states_;  // bounded by the uplink
};

}  // namespace pangea::phone
