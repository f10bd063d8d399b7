#include "common/alignment/match_sets.h"

#include <algorithm>
#include <map>
#include <set>
#include <tuple>
#include <utility>

namespace pangea {

std::vector<PointMatch> CandidateMatches(const Window& window_m, const Window& window_c,
                                         const PlaceCandidate& candidate) {
  std::vector<PointMatch> matches;
  const int m = window_m.newest(), c = window_c.newest();
  for (const auto& [corner_c, corner_m] : candidate.corner_matches) {
    if (!window_c.frames[c]->has_ray(corner_c) || !window_m.frames[m]->has_ray(corner_m)) {
      continue;
    }
    if (const int landmark = window_m.landmark_of_corner[m][corner_m]; landmark >= 0) {
      matches.push_back({Direction::kForward, landmark, {c, corner_c}, 0});
    }
    if (const int landmark = window_c.landmark_of_corner[c][corner_c]; landmark >= 0) {
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

std::vector<PointMatch> Agreeing(const Window& window_m, const Window& window_c,
                                 const std::vector<PointMatch>& matches) {
  std::map<std::pair<Direction, int>, std::map<int, int>> votes;
  const auto other_of = [&](const PointMatch& match) {
    const Window& observer = match.direction == Direction::kForward ? window_c : window_m;
    return observer.landmark_of_corner[match.observed.frame][match.observed.corner];
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

}  // namespace pangea
