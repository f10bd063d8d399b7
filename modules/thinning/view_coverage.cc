#include "thinning/view_coverage.h"

#include <algorithm>
#include <cmath>
#include <optional>

namespace pangea {
namespace {

// Maximum length of a gap: processes accept an edge across at most this many keyframes
// (ReorderBuffer::kMaxBuffered).
constexpr int kMaxGap = 500;

// Normalised distance between two views' cameras; 1 at the limit of one viewpoint.
double Apart(const View& a, const View& b, const CoverageOptions& options) {
  const double reach_m = options.distance_share * std::min(a.depth_m, b.depth_m);
  const double cosine =
      (a.T_map_cam.q * Eigen::Vector3d::UnitZ()).dot(b.T_map_cam.q * Eigen::Vector3d::UnitZ());
  return std::max((a.T_map_cam.t - b.T_map_cam.t).norm() / std::max(reach_m, 1e-9),
                  std::acos(std::clamp(cosine, -1.0, 1.0)) / std::max(options.angle, 1e-9));
}

class Choice {
 public:
  Choice(const std::vector<MapViews>& maps, const LooksAlike& looks_alike,
         const CoverageOptions& options)
      : maps_(maps), looks_alike_(looks_alike), options_(options) {}

  std::vector<std::vector<bool>> Run() {
    for (int map = 0; map < static_cast<int>(maps_.size()); ++map) {
      std::vector<bool> kept;
      for (int view = 0; view < static_cast<int>(maps_[map].views.size()); ++view) {
        kept.push_back(maps_[map].views[view].must_stay || !IsCovered({map, view}));
      }
      InRows(&kept);
      kept_.push_back(std::move(kept));
    }
    return std::move(kept_);
  }

 private:
  bool IsCovered(const ViewRef& ref) const {
    int maps = 0, alike = 0;
    for (int newer = 0; newer < ref.map; ++newer) {
      const auto nearest = maps_[newer].group == maps_[ref.map].group
                               ? Nearest(newer, maps_[ref.map].views[ref.view])
                               : std::nullopt;
      if (!nearest) {
        continue;
      }
      ++maps;
      if (maps < options_.maps &&
          (!maps_[ref.map].views[ref.view].recognised || looks_alike_(ref, {newer, *nearest}))) {
        ++alike;
      }
      if (maps >= options_.maps || alike >= options_.alike_maps) {
        return true;
      }
    }
    return false;
  }

  // The nearest kept view with the same viewpoint.
  std::optional<int> Nearest(int map, const View& view) const {
    std::optional<int> nearest;
    double least = 1;
    for (int i = 0; i < static_cast<int>(kept_[map].size()); ++i) {
      const double apart = kept_[map][i] ? Apart(maps_[map].views[i], view, options_) : 2;
      if (apart <= least) {
        least = apart;
        nearest = i;
      }
    }
    return nearest;
  }

  // Extends the kept views: each with its predecessors, no gap shorter than a window, and none
  // longer than kMaxGap. If any view stays, so does the map's first one: without it no edge would
  // show that nothing is missing before.
  void InRows(std::vector<bool>* kept) const {
    const std::vector<bool> chosen = *kept;
    if (std::ranges::find(chosen, true) == chosen.end()) {
      return;
    }
    (*kept)[0] = true;
    int last = 0;
    for (int i = 1; i < static_cast<int>(chosen.size()); ++i) {
      if (!chosen[i] && i - last <= kMaxGap) {
        continue;
      }
      const int first = i - last <= 2 * options_.window ? last : i - options_.window + 1;
      std::fill(kept->begin() + first, kept->begin() + i + 1, true);
      last = i;
    }
  }

  const std::vector<MapViews>& maps_;
  const LooksAlike& looks_alike_;
  const CoverageOptions& options_;
  std::vector<std::vector<bool>> kept_;
};

}  // namespace

std::vector<std::vector<bool>> ChooseViews(const std::vector<MapViews>& newest_first,
                                           const LooksAlike& looks_alike,
                                           const CoverageOptions& options) {
  return Choice(newest_first, looks_alike, options).Run();
}

}  // namespace pangea
