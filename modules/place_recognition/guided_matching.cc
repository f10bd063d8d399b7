#include "place_recognition/guided_matching.h"

#include <algorithm>

namespace pangea {
namespace {

constexpr int kFar = 257;  // more than any distance

struct Rival {
  int b = -1;
  int distance = kFar;
};

// Best and, elsewhere in the image, second best.
bool PassesRatio(const std::vector<Rival>& rivals, const Rival& best,
                 const std::vector<Corner>& corners, const MatchingOptions& options) {
  return std::none_of(rivals.begin(), rivals.end(), [&](const Rival& rival) {
    const Eigen::Vector2f apart = corners[rival.b].pixel - corners[best.b].pixel;
    return apart.norm() > static_cast<float>(options.other_corner_px) &&
           best.distance > options.max_ratio * rival.distance;
  });
}

}  // namespace

std::vector<std::pair<int, int>> MatchAlongEpipolarLines(const CornersAndRays& a,
                                                         const CornersAndRays& b,
                                                         const EpipolarModel& model,
                                                         double max_residual,
                                                         const MatchingOptions& options) {
  // A rival counts for the ratio test up to the distance at which it could no longer fail it.
  const int rival_distance = static_cast<int>(options.max_distance / options.max_ratio);
  std::vector<std::pair<int, Rival>> rows;
  std::vector<Rival> column_best(b.corners.size());  // of each b: its nearest a
  std::vector<Rival> rivals;
  for (int i = 0; i < static_cast<int>(a.corners.size()); ++i) {
    if (a.rays[i].sigma <= 0) {
      continue;
    }
    rivals.clear();
    Rival best;
    for (int j = 0; j < static_cast<int>(b.corners.size()); ++j) {
      const int distance = HammingDistance(a.corners[i].descriptor, b.corners[j].descriptor);
      if (distance > rival_distance || b.rays[j].sigma <= 0 ||
          model.Residual(a.rays[i], b.rays[j]) > max_residual) {
        continue;
      }
      rivals.push_back({j, distance});
      if (distance < best.distance) {
        best = rivals.back();
      }
      if (distance < column_best[j].distance) {
        column_best[j] = {i, distance};
      }
    }
    if (best.distance <= options.max_distance && PassesRatio(rivals, best, b.corners, options)) {
      rows.emplace_back(i, best);
    }
  }
  std::vector<std::pair<int, int>> matches;
  for (const auto& [i, best] : rows) {
    if (column_best[best.b].b == i) {
      matches.emplace_back(i, best.b);
    }
  }
  return matches;
}

}  // namespace pangea
