#pragma once

// Decides which tracks speak to the filter and how: short tracks once, when they end or are about
// to leave the window (Mourikis & Roumeliotis, ICRA 2007); long ones as landmarks in the state, at
// every image.

#include <cstdint>
#include <map>
#include <set>
#include <vector>

#include "vio/track_history.h"
#include "vio/window_filter.h"

namespace pangea::vio {

class FeatureUpdates {
 public:
  FeatureUpdates(int window, int max_landmarks) : window_(window), max_landmarks_(max_landmarks) {}

  struct Outcome {
    int used = 0;      // tracks and landmarks that passed their gate
    int rejected = 0;  // that did not
    std::vector<int32_t> outliers;
  };
  // After the newest clone was added to filter and history.
  Outcome Apply(WindowFilter& filter, const TrackHistory& history);
  // Before clone `index` is removed: landmarks anchored in it move to the newest clone that can
  // hold them.
  void MoveAnchors(WindowFilter& filter, int index);
  // What is known of a landmark's tracks is forgotten once no clone sees it.
  void Forget(const TrackHistory& history, const WindowState& state);

 private:
  struct Stack;
  void UpdateLandmarks(WindowFilter& filter, const TrackHistory& history, Outcome* outcome);
  void UpdateTracks(WindowFilter& filter, const TrackHistory& history, Outcome* outcome);
  void PromoteTracks(WindowFilter& filter, const TrackHistory& history, Outcome* outcome);
  int64_t UnusedFrom(int32_t landmark_id) const;

  int window_;
  int max_landmarks_;
  std::map<int32_t, int64_t> unused_from_;  // observations before this have been used
  std::map<int32_t, int> misses_;           // consecutive gate failures of landmarks in the state
};

// 95 % quantile of chi-square (Wilson & Hilferty, 1931).
double ChiSquare95(int degrees_of_freedom);

}  // namespace pangea::vio
