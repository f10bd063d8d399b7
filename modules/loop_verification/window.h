#pragma once

// A local window (the paper's vKF and vMP, section IV.D): a keyframe, the ones before it, and their
// map points; map points of the same landmark are merged.
//
// The frame `w` of a window has the axes of the map's odom frame, and its origin at the newest
// keyframe's body. With near origins, rotation and translation of an alignment are nearly
// uncorrelated.
//
// The alignment X = T_m_c maps window frame c (the query's) to window frame m (the match's).

#include <Eigen/Core>
#include <vector>

#include "core/keyframe_store.h"

namespace pangea {

// Minimum number of keyframes in a window (the paper's M). If the camera rotates more than it
// moves, more are taken, until the baseline suffices for depths or the maximum is reached.
inline constexpr int kWindowKeyframes = 5;
inline constexpr int kMaxWindowKeyframes = 10;
// Map points with a larger relative sigma of the inverse depth are ignored.
inline constexpr double kMaxRelativeDepthSigma = 0.4;

// For corners without a depth from the odometry (matched_corners.h).
struct TriangulationOptions {
  int few_landmarks = 150;  // a window with more landmarks gets none added

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
  CornerRef host;            // the corner whose depth is used
  double inverse_depth = 0;  // 1/m, host camera's z axis
  double inverse_depth_sigma = 0;
  Eigen::Vector3d p_w = Eigen::Vector3d::Zero();
  // Displacement of p_w by one sigma of the inverse depth, first order.
  Eigen::Vector3d depth_sigma_w = Eigen::Vector3d::Zero();
  // All corners of this landmark, ascending, including the host; a frame may have several
  // (octaves).
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

// The window frame's T_w_body along the edges, which are better than the published poses
// (keyframe_t.lcm).
std::vector<Rigid3> PosesAlongEdges(const KeyframeWindow& frames);

// The last of `frames`: as many as the window of the newest one needs.
KeyframeWindow LastOfWindow(const KeyframeWindow& frames);

// Makes a landmark without observations.
WindowLandmark MakeWindowLandmark(const Window& window, int32_t id, const CornerRef& host,
                                  double inverse_depth, double inverse_depth_sigma);

// `after`: the keyframes that follow the newest one; they are used only to triangulate its corners.
Window MakeWindow(KeyframeWindow frames, const WindowOptions& options,
                  const KeyframeWindow& after = {});

// Forward: a point of m observed by a camera of c. Reverse: a point of c observed by a camera of m.
enum class Direction { kForward, kReverse };
inline constexpr Direction kBothDirections[] = {Direction::kForward, Direction::kReverse};

// Two windows that outlive the pair.
struct WindowPair {
  const Window &m, &c;  // m: up to the candidate's match; c: up to the query

  // The window that holds the point, and the window whose camera observes it.
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
