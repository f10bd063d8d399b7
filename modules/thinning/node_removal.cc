#include "thinning/node_removal.h"

#include <algorithm>
#include <tuple>

namespace pangea {
namespace {

using Factor = NodeRemoval::Factor;

Factor Inverse(const Factor& factor) {
  Factor inverse = factor;
  inverse.relative = factor.relative.Inverse();
  return inverse;
}

Factor ComposeFactors(const Factor& a, const Factor& b) {
  Factor factor;
  factor.relative = Compose(a.relative, b.relative);
  factor.odometry = a.odometry && b.odometry;
  factor.derived = true;
  // Odometry has no inlier statistics: use those of the other factor.
  const Factor& weaker = a.odometry || (!b.odometry && b.num_inliers < a.num_inliers) ? b : a;
  factor.num_inliers = weaker.num_inliers;
  factor.inlier_ratio = weaker.inlier_ratio;
  factor.rms_px = std::max(a.rms_px, b.rms_px);
  return factor;
}

Factor AverageFactors(const Factor& a, const Factor& b) {
  Factor factor = a.num_inliers < b.num_inliers ? b : a;
  factor.relative = Average(a.relative, b.relative);
  factor.odometry = a.odometry || b.odometry;
  factor.derived = true;
  return factor;
}

}  // namespace

void NodeRemoval::AddOdometry(const KeyframeId& from, const KeyframeId& to,
                              const RelativePose& relative) {
  Put(from, to, {.relative = relative, .odometry = true});
}

void NodeRemoval::AddConstraint(const Constraint& constraint) {
  Put(constraint.from, constraint.to,
      {.relative = {constraint.T_from_to, constraint.covariance},
       .num_inliers = constraint.num_inliers,
       .inlier_ratio = constraint.inlier_ratio,
       .rms_px = constraint.rms_px});
}

void NodeRemoval::Put(const KeyframeId& from, const KeyframeId& to, const Factor& factor) {
  const auto [known, is_new] = factors_[from].try_emplace(to, factor);
  if (!is_new) {
    known->second = AverageFactors(known->second, factor);
  }
  factors_[to][from] = Inverse(known->second);
}

KeyframeId NodeRemoval::Hub(const Neighbours& neighbours, bool along_the_map) const {
  const auto rank = [&](const Neighbours::value_type& neighbour) {
    const auto& [id, factor] = neighbour;
    // Prefer neighbours along the map, and of these the ones that stay.
    return std::tuple(along_the_map && !factor.odometry, along_the_map && going_.contains(id),
                      LogDeterminant(factor.relative));
  };
  return std::ranges::min_element(neighbours, {}, rank)->first;
}

void NodeRemoval::Remove(const KeyframeId& id, bool along_the_map) {
  const auto node = factors_.extract(id);
  if (node.empty()) {
    return;
  }
  const Neighbours& neighbours = node.mapped();
  for (const auto& [neighbour, factor] : neighbours) {
    factors_.at(neighbour).erase(id);
  }
  if (neighbours.empty()) {
    return;
  }
  const KeyframeId hub = Hub(neighbours, along_the_map);
  const Factor from_hub = Inverse(neighbours.at(hub));
  for (const auto& [neighbour, factor] : neighbours) {
    if (neighbour != hub) {
      Put(hub, neighbour, ComposeFactors(from_hub, factor));
    }
  }
}

void NodeRemoval::RemoveRun(const std::vector<KeyframeId>& run) {
  going_ = {run.begin(), run.end()};
  // Remove from both ends, so that each keyframe is joined to the nearer one.
  for (size_t i = 0, j = run.size(); i < j;) {
    for (const KeyframeId& id : {run[i++], run[--j]}) {
      Remove(id, true);
      going_.erase(id);
    }
  }
}

void NodeRemoval::RemoveMaps(const std::set<KeyframeId>& keyframes) {
  // Remove those with the fewest factors first: with two factors no information is lost.
  std::set<std::pair<size_t, KeyframeId>> queue;
  const auto degree = [this](const KeyframeId& id) {
    const auto it = factors_.find(id);
    return it == factors_.end() ? size_t{0} : it->second.size();
  };
  for (const KeyframeId& id : keyframes) {
    queue.emplace(degree(id), id);
  }
  while (!queue.empty()) {
    const auto [known_degree, id] = *queue.begin();
    queue.erase(queue.begin());
    // Its degree has changed through other removals: put it back into the queue.
    if (const size_t now = degree(id); now > known_degree) {
      queue.emplace(now, id);
      continue;
    }
    Remove(id, false);
  }
}

}  // namespace pangea
