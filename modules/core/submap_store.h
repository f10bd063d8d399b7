#pragma once

// The keyframes of all maps that a server module keeps, and what matching derives from each once:
// undistorted rays, a grid over the corners, landmark look-ups.
//
// In: keyframes in any order. Out: views by id, and the window of keyframes up to
// one of them. Bounded: beyond max_keyframes the keyframe added first is dropped; derived data is
// kept for the max_views keyframes used last and made again when asked for. Not thread safe.

#include <Eigen/Core>
#include <cstdint>
#include <deque>
#include <list>
#include <map>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "core/keyframe.h"
#include "core/matching.h"

namespace pangea {

// One keyframe ready for matching. Indices named `corner` are indices into keyframe->corners.
class KeyframeView {
 public:
  explicit KeyframeView(std::shared_ptr<const Keyframe> keyframe);

  const Keyframe& keyframe() const { return *keyframe_; }
  const Rigid3& T_odom_cam() const { return T_odom_cam_; }

  // False where the pixel has no ray; then neither ray nor pixel_jacobian may be used.
  bool has_ray(int corner) const { return has_ray_[corner]; }
  // (x, y) on the plane z = 1 of the camera.
  Eigen::Vector2d ray(int corner) const { return rays_[corner].cast<double>(); }
  // d(raw pixel)/d(ray) at the corner: turns a difference of rays into pixels.
  Eigen::Matrix2d pixel_jacobian(int corner) const {
    return pixel_jacobians_[corner].cast<double>();
  }

  // The corners that are a landmark, ascending: one for each octave it was described on.
  std::vector<int> CornersOfLandmark(int32_t landmark_id) const;
  const CornerGrid& grid() const { return grid_; }

 private:
  std::shared_ptr<const Keyframe> keyframe_;
  Rigid3 T_odom_cam_;
  std::vector<bool> has_ray_;
  std::vector<Eigen::Vector2f> rays_;
  std::vector<Eigen::Matrix2f> pixel_jacobians_;
  std::vector<std::pair<int32_t, int>> landmark_corners_;  // sorted by landmark
  CornerGrid grid_;
};

// Keyframes of one map, ascending seq, joined by their odometry edges; the newest is the one asked
// for.
using KeyframeWindow = std::vector<std::shared_ptr<const KeyframeView>>;

struct SubmapStoreOptions {
  // A keyframe of 700 corners takes about 40 kB, its view about 25 kB more.
  int max_keyframes = 20000;
  int max_views = 256;
  bool keep_preintegration = false;  // nothing that matches places needs it
};

class SubmapStore {
 public:
  explicit SubmapStore(SubmapStoreOptions options = {}) : options_(options) {}

  // A keyframe that is already there stays as it is.
  void Add(Keyframe keyframe);

  // Nobody has these keyframes any more (the gaps in HAVE): nothing waits for them.
  void NoteLost(const MapId& map, int32_t from_seq, int32_t to_seq);

  bool Contains(const KeyframeId& id) const { return keyframes_.contains(id); }
  size_t size() const { return keyframes_.size(); }

  // Null when it is not there.
  std::shared_ptr<const KeyframeView> Find(const KeyframeId& id);
  // The keyframe and up to `count` - 1 before it, along the odometry edges; shorter where the map
  // begins or an edge is missing, empty when the keyframe is not there.
  KeyframeWindow WindowUpTo(const KeyframeId& id, int count);
  // Whether WindowUpTo would be cut short by a keyframe that is missing: more may arrive.
  bool WindowIsComplete(const KeyframeId& id, int count) const;
  // Whether the walk from the newer keyframe back along the edges meets no missing keyframe before
  // it reaches or passes the older one, or the beginning of a piece of map.
  bool ChainIsComplete(const KeyframeId& older, const KeyframeId& newer) const;
  // Metres travelled along the edges from the older to the newer keyframe of one map, straight over
  // what was lost; nothing where they do not lead from one to the other.
  std::optional<double> PathBetween(const KeyframeId& older, const KeyframeId& newer) const;

 private:
  // First seq of the lost run that this keyframe is in.
  std::optional<int32_t> LostSince(const KeyframeId& id) const;

  struct Cached {
    std::shared_ptr<const KeyframeView> view;
    std::list<KeyframeId>::iterator use;
  };

  SubmapStoreOptions options_;
  std::map<KeyframeId, std::shared_ptr<const Keyframe>> keyframes_;
  std::map<KeyframeId, int32_t> lost_;  // last of a run -> its first seq
  std::deque<KeyframeId> arrival_;
  std::map<KeyframeId, Cached> views_;
  std::list<KeyframeId> uses_;  // newest first
};

}  // namespace pangea
