#include "loop_verification/steps/visibility_check.h"

#include <algorithm>
#include <cmath>
#include <map>

namespace pangea {
namespace {

constexpr int kVisibilityStride = 3;  // every third keyframe on the way is searched
constexpr char kContradicted[] = "the surroundings contradict";

}  // namespace

int ImageCell(const CameraModel& camera, const Eigen::Vector2d& pixel) {
  constexpr int kCols = 6, kRows = 4;
  const int col = std::clamp(static_cast<int>(pixel.x() * kCols / camera.width), 0, kCols - 1);
  const int row = std::clamp(static_cast<int>(pixel.y() * kRows / camera.height), 0, kRows - 1);
  return row * kCols + col;
}

void VisibilityCount::Add(const CameraModel& camera, const SearchResult& result) {
  std::map<int, Cell> cells;
  for (const Projection& projection : result.projections) {
    if (projection.comparable) {
      Cell& cell = cells[ImageCell(camera, projection.pixel)];
      ++cell.comparable;
      cell.found += projection.found ? 1 : 0;
    }
  }
  for (const auto& [index, cell] : cells) {
    comparable_ += cell.comparable;
    found_ += cell.found;
    cells_.push_back(cell);
  }
}

double VisibilityCount::supported_share() const {
  // Expectation maximisation over the rate and the share. The rate of chance finds is a property of
  // the search: a corner in the search radius has a similar descriptor by accident. On real images
  // it is 0.02 to 0.04, compared with 0.2 to 0.3 if the alignment is right.
  constexpr double kChanceRate = 0.04, kMinRate = 0.08;
  constexpr int kIterations = 30;
  if (cells_.empty() || found_ == 0) {
    return 0;
  }
  double rate = std::clamp(1.5 * found_share(), kMinRate, 0.9);
  double share = 0.5;
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    double supporting = 0, comparable = 0, found = 0;
    for (const Cell& cell : cells_) {
      const int missed = cell.comparable - cell.found;
      const double log_odds = cell.found * std::log(rate / kChanceRate) +
                              missed * std::log((1 - rate) / (1 - kChanceRate)) +
                              std::log(share / (1 - share));
      const double weight = 1 / (1 + std::exp(-log_odds));
      supporting += weight;
      comparable += weight * cell.comparable;
      found += weight * cell.found;
    }
    rate = std::clamp(found / std::max(comparable, 1e-9), kMinRate, 0.95);
    share = std::clamp(supporting / static_cast<double>(cells_.size()), 0.01, 0.99);
  }
  return share;
}

std::string CheckVisibility(const VisibilityOptions& options, Verification* verification) {
  Verification& v = *verification;
  VisibilityCount count;
  // The second round searches again with the refined pose.
  for (int round = 0; round < 2; ++round) {
    std::vector<PointMatch> matches;
    count = {};
    for (const Direction direction : kBothDirections) {
      const Window& observer = v.windows.Observer(direction);
      const SearchResult result =
          SearchByProjection(v.windows, direction, observer.newest(), v.pose);
      matches.insert(matches.end(), result.matches.begin(), result.matches.end());
      count.Add(observer.newest_keyframe().camera, result);
    }
    if (!v.AtLeast("min_found", static_cast<double>(matches.size()), options.min_found)) {
      return "too few points found by projection";
    }
    v.pose = RefinePose(v.Observations(matches), v.pose.T_m_c, v.guess_tilt_sigma);
  }
  const bool enough = v.AtLeast("min_comparable", count.comparable(), options.min_comparable);
  const bool found = v.AtLeast("min_found_share", count.found_share(), options.min_found_share);
  const bool supported = v.AtLeast("min_first_supported_share", count.supported_share(),
                                   options.min_first_supported_share);
  if (!enough) {
    return "too few points ought to be seen from both";
  }
  return found && supported ? "" : kContradicted;
}

std::string CheckWiderVisibility(const VisibilityOptions& options, Verification* verification) {
  Verification& v = *verification;
  const auto wide_m = v.window_cache.Make(v.keyframes.m, v.options.window, v.keyframes.after_m);
  const auto wide_c = v.window_cache.Make(v.keyframes.c, v.options.window);
  const WindowPair wide{*wide_m, *wide_c};
  const PoseEstimate pose{v.ba->T_m_c, v.pose.covariance};
  VisibilityCount count;
  for (const Direction direction : kBothDirections) {
    const Window& observer = wide.Observer(direction);
    for (int frame = observer.newest(); frame >= 0; frame -= kVisibilityStride) {
      count.Add(observer.keyframe(frame).camera, SearchByProjection(wide, direction, frame, pose));
    }
  }
  return v.AtLeast("min_supported_share", count.supported_share(), options.min_supported_share)
             ? ""
             : kContradicted;
}

}  // namespace pangea
