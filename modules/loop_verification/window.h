#pragma once

// A local window (the paper's vKF and vMP, section IV.D): a keyframe, those before it, and the map
// points they hold, merged over the landmark they observe.
//
// Frame `w` of a window: gravity-aligned like the map's odom, its origin at the newest keyframe's
// body. Near origins keep rotations and translations of an alignment well separated.
//
// The alignment X = T_m_c takes window frame c (the query's) to window frame m (the match's).

#include <Eigen/Core>
#include <vector>

#include "core/submap_store.h"

namespace pangea {

// At least: the keyframe and those before it (the paper's M). Of a camera that turns more than it
// moves, as many more as it takes to see depths.
inline constexpr int kWindowKeyframes = 5;
inline constexpr int kMaxWindowKeyframes = 10;
// Inverse depths less certain than this share of themselves are no map points.
inline constexpr double kMaxRelativeDepthSigma = 0.4;

// Of corners that no track gave a depth.
struct TriangulationOptions {
  int few_landmarks = 150;  // of a window; with more, none are added

  template <typename Archive>
  void Visit(Archive& archive) {
    archive.Add("few_landmarks", &few_landmarks, {-1, 100000}, "",
                "a window with more gets none; -1: no window does");
  }
};

struct WindowOptions {
  TriangulationOptions triangulation;

  template <typename Archive>
  void Visit(Archive& archive) {
    archive.Section("triangulation", &triangulation, "of corners that no track gave a depth");
  }
};

struct CornerRef {
  int frame = 0;  // index into the window's frames
  int corner = 0;
};

struct WindowLandmark {
  int32_t id = kNoLandmark;
  CornerRef host;            // where its depth is best known
  double inverse_depth = 0;  // 1/m, host camera's z axis
  double inverse_depth_sigma = 0;
  Eigen::Vector3d p_w = Eigen::Vector3d::Zero();
  // What one sigma of inverse depth moves p_w by, first order.
  Eigen::Vector3d depth_sigma_w = Eigen::Vector3d::Zero();
  // Every corner that is this landmark, ascending, host included; one or more in a frame (octaves).
  std::vector<CornerRef> observations;
};

struct Window {
  KeyframeWindow frames;  // ascending; the last is the keyframe itself
  std::vector<Rigid3> T_w_body;
  std::vector<Rigid3> T_w_cam;
  std::vector<WindowLandmark> landmarks;
  std::vector<std::vector<int>> landmark_of_corner;  // [frame][corner], or -1

  int newest() const { return static_cast<int>(frames.size()) - 1; }
  const Keyframe& keyframe(int frame) const { return frames[frame]->keyframe(); }
  const Keyframe& newest_keyframe() const { return frames.back()->keyframe(); }
  const Corner& corner(const CornerRef& ref) const {
    return keyframe(ref.frame).corners[ref.corner];
  }
};

// Of keyframes up to one, the last that make its window.
KeyframeWindow LastOfWindow(const KeyframeWindow& frames);

// Without its observations.
WindowLandmark MakeWindowLandmark(const Window& window, int32_t id, const CornerRef& host,
                                  double inverse_depth, double inverse_depth_sigma);

// `after`: keyframes of the map behind the newest one, which only triangulate its corners.
Window MakeWindow(KeyframeWindow frames, const WindowOptions& options,
                  const KeyframeWindow& after = {});

// Forward: a point of m in a camera of c. Reverse: a point of c in a camera of m.
enum class Direction { kForward, kReverse };
inline constexpr Direction kBothDirections[] = {Direction::kForward, Direction::kReverse};

struct WindowPair {
  Window m, c;  // up to the candidate's match; up to the query

  // Whose point it is, and whose camera sees it.
  const Window& Holder(Direction direction) const {
    return direction == Direction::kForward ? m : c;
  }
  const Window& Observer(Direction direction) const {
    return direction == Direction::kForward ? c : m;
  }
};

inline Rigid3 ObserverFromHolder(Direction direction, const Rigid3& T_m_c) {
  return direction == Direction::kForward ? T_m_c.Inverse() : T_m_c;
}

}  // namespace pangea
