#pragma once

// The keyframes of all maps that a server module keeps. A keyframe is read as a KeyframeView, with
// what matching derives from it: undistorted rays, a grid over the corners, landmark look-ups.
//
// In: keyframes in any order. Out: views by id, and windows of consecutive keyframes. In memory are
// about 200 bytes of every keyframe (its position, its edge, where its record is) and the views of
// the max_views keyframes used last. The rest is in a RecordStore. Records that find no room there
// stay in memory; beyond max_in_memory of them the one that was added first is dropped. Results
// depend on where a record is only through such drops. Not thread safe.

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "core/byte_record.h"
#include "core/keyframe.h"
#include "core/matching.h"
#include "core/recent_cache.h"
#include "core/record_store.h"

namespace pangea {

// One keyframe, prepared for matching. `corner` is always an index into keyframe().corners.
class KeyframeView {
 public:
  explicit KeyframeView(std::shared_ptr<const Keyframe> keyframe);

  const Keyframe& keyframe() const { return *keyframe_; }
  const Rigid3& T_odom_cam() const { return T_odom_cam_; }

  // False if the pixel cannot be undistorted. Then neither ray nor pixel_jacobian may be used.
  bool has_ray(int corner) const { return has_ray_[corner]; }
  // The undistorted ray: (x, y) on the plane z = 1 of the camera frame.
  Eigen::Vector2d ray(int corner) const { return rays_[corner].cast<double>(); }
  // d(raw pixel)/d(ray) at the corner; it converts a difference of rays to pixels.
  Eigen::Matrix2d pixel_jacobian(int corner) const {
    return pixel_jacobians_[corner].cast<double>();
  }

  // The corners that show a landmark, ascending: one for each octave on which it was described.
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

// Keyframes of one map in ascending seq, each joined to the one before it by its odometry edge.
using KeyframeWindow = std::vector<std::shared_ptr<const KeyframeView>>;

struct KeyframeStoreOptions {
  int max_in_memory = 20000;         // about 30 kB each
  int max_views = 256;               // about 65 kB each
  bool keep_preintegration = false;  // place matching does not need it
};

class KeyframeStore {
 public:
  // Without a RecordStore all records stay in memory.
  explicit KeyframeStore(KeyframeStoreOptions options = {},
                         std::shared_ptr<RecordStore> records = nullptr)
      : options_(options), records_(std::move(records)), views_(options.max_views) {}

  // The bytes that the store keeps of a keyframe in its RecordStore.
  static std::vector<uint8_t> RecordOf(Keyframe keyframe, const KeyframeStoreOptions& options);

  // A keyframe that is already there stays as it is.
  void Add(Keyframe keyframe);

  // Saves where the records are, not the records. No record may be in memory, and the RecordStore
  // at Restore must have them at the same offsets. Restore reads to the end, so a caller saves the
  // store last; it returns false, and changes nothing, if the bytes are not those of a store.
  void Save(ByteWriter* writer) const;
  bool Restore(ByteReader* reader);

  // These keyframes are lost: nobody has them any more (HAVE names such gaps). From now on windows
  // and chains count as complete without them. The same holds for a keyframe that was dropped.
  void NoteLost(const MapId& map, int32_t from_seq, int32_t to_seq);

  bool Contains(const KeyframeId& id) const { return keyframes_.contains(id); }
  size_t size() const { return keyframes_.size(); }
  const RecordCounters& counters() const { return counters_; }

  // Null when the keyframe is not there or cannot be read.
  std::shared_ptr<const KeyframeView> Find(const KeyframeId& id);
  // The keyframe and up to `count` - 1 keyframes before it, along the odometry edges. Shorter where
  // the map begins, or an edge or a keyframe is missing; empty when `id` itself is not there.
  KeyframeWindow WindowUpTo(const KeyframeId& id, int count);
  // At most `count` keyframes that follow `id`, each joined by its edge to the one just before it.
  KeyframeWindow WindowBehind(const KeyframeId& id, int count);
  // False if a missing keyframe that may still arrive cuts WindowUpTo short. A window that begins
  // at a lost keyframe, or where the map begins, is complete.
  bool WindowIsComplete(const KeyframeId& id, int count) const;
  // Follows the edges back from the newer keyframe to the older one, or to a keyframe without edge,
  // and passes over lost keyframes. False if it meets a missing keyframe that may still arrive.
  bool ChainIsComplete(const KeyframeId& older, const KeyframeId& newer) const;
  // Length of the path along the edges between two keyframes of one map, metres. Lost keyframes are
  // bridged by a straight line. Nothing if the edges do not join the two keyframes.
  std::optional<double> PathBetween(const KeyframeId& older, const KeyframeId& newer) const;

 private:
  // First seq of the run of lost keyframes that contains `id`; nothing if `id` is not lost.
  std::optional<int32_t> LostSince(const KeyframeId& id) const;

  struct Stored {
    Record record;
    Eigen::Vector3d p_odom_body;
    std::optional<int32_t> edge_from_seq;
    double edge_m = 0;  // its length
  };

  void DropOne();

  KeyframeStoreOptions options_;
  std::shared_ptr<RecordStore> records_;
  std::map<KeyframeId, Stored> keyframes_;
  std::map<KeyframeId, int32_t> lost_;  // last keyframe of a lost run -> first seq of the run
  std::deque<KeyframeId> in_memory_;    // in the order they came
  RecentCache<KeyframeId, KeyframeView> views_;
  RecordCounters counters_;
};

}  // namespace pangea
