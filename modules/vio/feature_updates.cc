#include "vio/feature_updates.h"

#include <algorithm>
#include <cmath>

namespace pangea::vio {
namespace {

constexpr size_t kMinTrackLength = 4;
constexpr size_t kMaxTracksPerImage = 40;  // bounds the time of one image
constexpr int kMaxMisses = 2;
constexpr double kMaxTriangulationRms = 3.0;  // sigmas

}  // namespace

double ChiSquare95(int degrees_of_freedom) {
  const double k = degrees_of_freedom;
  const double c = 1 - 2 / (9 * k) + 1.6449 * std::sqrt(2 / (9 * k));
  return k * c * c * c;
}

// Whitened rows collected for one update.
struct FeatureUpdates::Stack {
  std::vector<Measurement> parts;
  int rows = 0;

  void Add(Measurement m) {
    rows += static_cast<int>(m.r.size());
    parts.push_back(std::move(m));
  }
  void UpdateAndClear(WindowFilter& filter) {
    if (rows == 0) {
      return;
    }
    Measurement all;
    all.H.resize(rows, filter.state().size());
    all.r.resize(rows);
    int at = 0;
    for (const Measurement& part : parts) {
      const auto n = part.r.size();
      all.H.middleRows(at, n) = part.H;
      all.r.segment(at, n) = part.r;
      at += static_cast<int>(n);
    }
    filter.Update(all, 1.0);
    parts.clear();
    rows = 0;
  }
};

int64_t FeatureUpdates::UnusedFrom(int32_t landmark_id) const {
  const auto it = unused_from_.find(landmark_id);
  return it == unused_from_.end() ? 0 : it->second;
}

FeatureUpdates::Outcome FeatureUpdates::Apply(WindowFilter& filter, const TrackHistory& history) {
  Outcome outcome;
  UpdateTracks(filter, history, &outcome);
  UpdateLandmarks(filter, history, &outcome);
  PromoteTracks(filter, history, &outcome);
  return outcome;
}

void FeatureUpdates::UpdateTracks(WindowFilter& filter, const TrackHistory& history,
                                  Outcome* outcome) {
  const WindowState& state = filter.state();
  const int64_t newest = state.clones.back().utime;
  // Tracks that ended: all of the second newest image's that the newest has not.
  std::map<int32_t, std::vector<ClonedRay>> ended;
  for (const Clone& clone : state.clones) {
    for (const auto& [id, ray] : history.Frame(clone.utime)) {
      if (!ended.contains(id) && !history.Sees(newest, id) && state.LandmarkIndex(id) < 0) {
        ended[id] = history.RaysOf(id, state, UnusedFrom(id));
      }
    }
  }
  std::vector<std::pair<int32_t, std::vector<ClonedRay>>> order;
  for (auto& [id, rays] : ended) {
    if (rays.size() >= kMinTrackLength) {
      order.emplace_back(id, std::move(rays));
    }
    unused_from_[id] = newest;
  }
  std::stable_sort(order.begin(), order.end(),
                   [](const auto& a, const auto& b) { return a.second.size() > b.second.size(); });
  Stack stack;
  for (size_t i = 0; i < std::min(order.size(), kMaxTracksPerImage); ++i) {
    const auto& [id, rays] = order[i];
    const auto point = Triangulate(state, rays, rays.front().clone);
    if (!point || point->rms > kMaxTriangulationRms) {
      continue;
    }
    const auto measured = MeasurePoint(state, point->point, rays);
    if (!measured) {
      continue;
    }
    Measurement m = WithoutPoint(*measured);
    if (filter.Nis(m, 1.0) > ChiSquare95(static_cast<int>(m.r.size()))) {
      ++outcome->rejected;
      continue;
    }
    ++outcome->used;
    stack.Add(std::move(m));
  }
  stack.UpdateAndClear(filter);
}

void FeatureUpdates::UpdateLandmarks(WindowFilter& filter, const TrackHistory& history,
                                     Outcome* outcome) {
  const int newest = static_cast<int>(filter.state().clones.size()) - 1;
  const int64_t newest_utime = filter.state().clones.back().utime;
  const auto& seen = history.Frame(newest_utime);
  for (int i = static_cast<int>(filter.state().landmarks.size()) - 1; i >= 0; --i) {
    const int32_t id = filter.state().landmarks[i].first;
    if (!seen.contains(id)) {
      filter.RemoveLandmark(i);
      misses_.erase(id);
    }
  }
  const WindowState& state = filter.state();
  Stack stack;
  std::vector<int32_t> lost;
  for (int i = 0; i < static_cast<int>(state.landmarks.size()); ++i) {
    const auto& [id, point] = state.landmarks[i];
    const ClonedRay& ray = seen.at(id);
    unused_from_[id] = newest_utime + 1;
    const auto predicted = PredictRay(state, point, newest, true);
    bool passed = predicted.has_value();
    if (passed) {
      Measurement m;
      m.H = predicted->H_x / ray.sigma;
      m.H.middleCols(state.LandmarkOffset(i), 3) = predicted->H_f / ray.sigma;
      m.r = (ray.ray - predicted->ray) / ray.sigma;
      passed = filter.Nis(m, 1.0) < ChiSquare95(2);
      if (passed) {
        stack.Add(std::move(m));
        misses_[id] = 0;
      }
    }
    ++(passed ? outcome->used : outcome->rejected);
    if (!passed && ++misses_[id] >= kMaxMisses) {
      lost.push_back(id);
    }
  }
  stack.UpdateAndClear(filter);
  for (const int32_t id : lost) {
    filter.RemoveLandmark(filter.state().LandmarkIndex(id));
    misses_.erase(id);
    outcome->outliers.push_back(id);
  }
}

// Tracks as long as the window become landmarks while there is room; the others speak once and
// start anew.
void FeatureUpdates::PromoteTracks(WindowFilter& filter, const TrackHistory& history,
                                   Outcome* outcome) {
  const int64_t newest = filter.state().clones.back().utime;
  size_t taken = 0;
  for (const auto& [id, newest_ray] : history.Frame(newest)) {
    if (filter.state().LandmarkIndex(id) >= 0) {
      continue;
    }
    const std::vector<ClonedRay> rays = history.RaysOf(id, filter.state(), UnusedFrom(id));
    if (static_cast<int>(rays.size()) < window_ || taken >= kMaxTracksPerImage) {
      continue;
    }
    const auto point = Triangulate(filter.state(), rays, rays.back().clone);
    const auto measured = point && point->rms < kMaxTriangulationRms
                              ? MeasurePoint(filter.state(), point->point, rays)
                              : std::nullopt;
    if (!measured) {
      continue;
    }
    ++taken;
    unused_from_[id] = newest + 1;
    Measurement m = WithoutPoint(*measured);
    if (filter.Nis(m, 1.0) > ChiSquare95(static_cast<int>(m.r.size()))) {
      ++outcome->rejected;
      outcome->outliers.push_back(id);
      continue;
    }
    ++outcome->used;
    const bool room = static_cast<int>(filter.state().landmarks.size()) < max_landmarks_;
    if (room) {
      filter.AddLandmark(id, point->point, measured->x, measured->H_f, 1.0);
    } else {
      filter.Update(m, 1.0);
    }
  }
}

void FeatureUpdates::MoveAnchors(WindowFilter& filter, int index) {
  const int64_t utime = filter.state().clones[index].utime;
  for (int i = static_cast<int>(filter.state().landmarks.size()) - 1; i >= 0; --i) {
    if (filter.state().landmarks[i].second.anchor_utime != utime) {
      continue;
    }
    const int newest = static_cast<int>(filter.state().clones.size()) - 1;
    const auto moved = Reanchor(filter.state(), i, newest);
    if (moved) {
      filter.ReplaceLandmark(i, moved->point, moved->J);
    } else {
      filter.RemoveLandmark(i);
    }
  }
}

void FeatureUpdates::Forget(const TrackHistory& history, const WindowState& state) {
  std::set<int32_t> alive;
  for (const Clone& clone : state.clones) {
    for (const auto& [id, ray] : history.Frame(clone.utime)) {
      alive.insert(id);
    }
  }
  std::erase_if(unused_from_, [&](const auto& item) { return !alive.contains(item.first); });
}

}  // namespace pangea::vio
