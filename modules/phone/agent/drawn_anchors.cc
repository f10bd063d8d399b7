#include "phone/agent/drawn_anchors.h"

namespace pangea::phone {

void DrawnAnchors::Take(const AnchorState& state) {
  if (state.gone) {
    states_.erase(state.anchor);
  } else {
    states_[state.anchor] = state;
  }
}

std::vector<DrawnAnchor> DrawnAnchors::Draw(const ShownAnchors& shown) const {
  std::vector<DrawnAnchor> drawn;
  for (const ShownAnchor& anchor : shown.anchors) {
    if (const AnchorState* const state = Find(anchor.anchor)) {
      drawn.push_back({anchor.anchor, state->name, state->payload, anchor.T_odom_anchor,
                       LargestSigma(state->covariance.topLeftCorner<3, 3>()), anchor.revision});
    }
  }
  return drawn;
}

const AnchorState* DrawnAnchors::Find(const AnchorId& id) const {
  const auto found = states_.find(id);
  return found == states_.end() ? nullptr : &found->second;
}

}  // namespace pangea::phone
