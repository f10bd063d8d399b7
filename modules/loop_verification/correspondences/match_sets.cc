#include "loop_verification/correspondences/match_sets.h"

#include <algorithm>
#include <map>
#include <set>
#include <tuple>
#include <utility>

#include "core/median.h"

namespace pangea {

std::vector<PointMatch> CandidateMatches(const WindowPair& windows,
                                         const PlaceCandidate& candidate) {
  std::vector<PointMatch> matches;
  const int m = windows.m.newest(), c = windows.c.newest();
  for (const auto& [corner_c, corner_m] : candidate.corner_matches) {
    if (!windows.c.frames[c]->has_ray(corner_c) || !windows.m.frames[m]->has_ray(corner_m)) {
      continue;
    }
    if (const int landmark = windows.m.landmark_of_corner[m][corner_m]; landmark >= 0) {
      matches.push_back({Direction::kForward, landmark, {c, corner_c}, 0});
    }
    if (const int landmark = windows.c.landmark_of_corner[c][corner_c]; landmark >= 0) {
      matches.push_back({Direction::kReverse, landmark, {m, corner_m}, 0});
    }
  }
  return matches;
}

std::vector<PointMatch> Distinct(const std::vector<PointMatch>& matches) {
  std::set<std::tuple<Direction, int, int>> seen;
  std::vector<PointMatch> distinct;
  for (const PointMatch& match : matches) {
    if (seen.emplace(match.direction, match.landmark, match.observed.corner).second) {
      distinct.push_back(match);
    }
  }
  return distinct;
}

std::vector<PointMatch> Agreeing(const WindowPair& windows,
                                 const std::vector<PointMatch>& matches) {
  std::map<std::pair<Direction, int>, std::map<int, int>> votes;
  const auto other_of = [&](const PointMatch& match) {
    return windows.Observer(match.direction)
        .landmark_of_corner[match.observed.frame][match.observed.corner];
  };
  for (const PointMatch& match : matches) {
    if (const int other = other_of(match); other >= 0) {
      ++votes[{match.direction, match.landmark}][other];
    }
  }
  std::vector<PointMatch> agreeing;
  for (const PointMatch& match : matches) {
    const int other = other_of(match);
    if (other >= 0) {
      const auto& ballot = votes.at({match.direction, match.landmark});
      const auto most =
          std::max_element(ballot.begin(), ballot.end(),
                           [](const auto& a, const auto& b) { return a.second < b.second; });
      if (most->first != other) {
        continue;
      }
    }
    agreeing.push_back(match);
  }
  return agreeing;
}

std::vector<ShownMatch> Shown(const WindowPair& windows, const std::vector<PointMatch>& matches,
                              const std::vector<bool>& inlier, const Rigid3& T_m_c_before,
                              const Rigid3& T_m_c_after) {
  std::vector<ShownMatch> shown;
  for (size_t i = 0; i < matches.size(); ++i) {
    const PointMatch& match = matches[i];
    const Window& holder = windows.Holder(match.direction);
    const Window& observer = windows.Observer(match.direction);
    if (match.observed.frame != observer.newest()) {
      continue;
    }
    const Eigen::Vector3d& p_w = holder.landmarks[match.landmark].p_w;
    const Eigen::Vector2d corner = observer.corner(match.observed).pixel.cast<double>();
    const auto pixel = [&p_w](const Window& window, const Rigid3& T_window_holder) {
      return window.keyframe(window.newest())
          .camera.Project(window.T_w_cam.back().Inverse() * (T_window_holder * p_w))
          .value_or(Eigen::Vector2d::Constant(-1));
    };
    const Eigen::Vector2d own = pixel(holder, Rigid3());
    const auto miss = [&](const Rigid3& T_m_c) {
      return (pixel(observer, ObserverFromHolder(match.direction, T_m_c)) - corner).norm();
    };
    const bool forward = match.direction == Direction::kForward;
    shown.push_back({forward ? own : corner, forward ? corner : own, inlier[i], miss(T_m_c_before),
                     miss(T_m_c_after)});
  }
  return shown;
}

std::array<std::vector<PointMatch>, 2> HalvesOfView(const WindowPair& windows,
                                                    const std::vector<PointMatch>& matches,
                                                    const Rigid3& T_m_c) {
  const Rigid3& T_w_cam = windows.m.T_w_cam.back();
  const Eigen::Vector3d view_ray = T_w_cam.q * Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d across = view_ray.cross(Eigen::Vector3d::UnitZ());
  std::vector<double> sides;
  for (const PointMatch& match : matches) {
    const bool forward = match.direction == Direction::kForward;
    const Eigen::Vector3d& p_w = windows.Holder(match.direction).landmarks[match.landmark].p_w;
    const Eigen::Vector3d ray = (forward ? p_w : Eigen::Vector3d(T_m_c * p_w)) - T_w_cam.t;
    sides.push_back(ray.dot(across) / ray.dot(view_ray));
  }
  const double middle = Median(sides);
  std::array<std::vector<PointMatch>, 2> halves;
  for (size_t i = 0; i < matches.size(); ++i) {
    halves[sides[i] < middle ? 0 : 1].push_back(matches[i]);
  }
  return halves;
}

}  // namespace pangea
