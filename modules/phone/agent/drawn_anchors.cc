#include "phone/agent/drawn_anchors.h"

#include <Eigen/Eigenvalues>
#include <cmath>

namespace pangea::phone {
namespace {

double LargestSigma_m(const Matrix6d& covariance) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(
      Eigen::Matrix3d(covariance.topLeftCorner<3, 3>()), Eigen::EigenvaluesOnly);
  return std::sqrt(std::max(0.0, solver.eigenvalues()(2)));
}

}  // namespace

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
                       LargestSigma_m(state->covariance), anchor.revision});
    }
  }
  return drawn;
}

const AnchorState* DrawnAnchors::Find(const AnchorId& id) const {
  const auto found = states_.find(id);
  return found == states_.end() ? nullptr : &found->second;
}

}  // namespace pangea::phone
