#pragma once

// The keyframes of all maps that a server module keeps, and what matching derives from each once:
// undistorted rays, a grid over the corners, landmark look-ups.
//
// In: keyframes in any order. Out: views by id, and the window of keyframes up to
// one of them. In memory are, of every keyframe, where it is and what leads from one to the next
// (some 200 bytes), and the views of the max_views keyframes used last. The rest is in a
// RecordStore. What that has no room for stays in memory, encoded, and is bounded there: beyond
// max_in_memory the one of these that was added first is dropped. No result depends on what lies
// where. Not thread safe.

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
  int max_in_memory = 20000;         // about 30 kB each
  int max_views = 256;               // about 65 kB each
  bool keep_preintegration = false;  // nothing that matches places needs it
};

class SubmapStore {
 public:
  // Without a RecordStore everything stays in memory.
  explicit SubmapStore(SubmapStoreOptions options = {},
                       std::shared_ptr<RecordStore> records = nullptr)
      : options_(options), records_(std::move(records)), views_(options.max_views) {}

  // What it keeps of a keyframe in the RecordStore.
  static std::vector<uint8_t> RecordOf(Keyframe keyframe, const SubmapStoreOptions& options);

  // A keyframe that is already there stays as it is.
  void Add(Keyframe keyframe);

  // Saves where the records are, not the records, none of which may be in memory: the store that is
  // restored must have them at the same places. Restore reads to the end, so a caller saves the
  // store last; it returns false, and changes nothing, if the bytes are not those of a store.
  void Save(ByteWriter* writer) const;
  bool Restore(ByteReader* reader);

  // Nobody has these keyframes any more (the gaps in HAVE): nothing waits for them.
  void NoteLost(const MapId& map, int32_t from_seq, int32_t to_seq);

  bool Contains(const KeyframeId& id) const { return keyframes_.contains(id); }
  size_t size() const { return keyframes_.size(); }
  const RecordCounters& counters() const { return counters_; }

  // Null when it is not there, or cannot be read.
  std::shared_ptr<const KeyframeView> Find(const KeyframeId& id);
  // The keyframe and up to `count` - 1 before it, along the odometry edges; shorter where the map
  // begins or an edge is missing, empty when the keyframe is not there.
  KeyframeWindow WindowUpTo(const KeyframeId& id, int count);
  // At most `count` keyframes behind it, each joined to the one before; none where it is not there.
  KeyframeWindow WindowBehind(const KeyframeId& id, int count);
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

  struct Stored {
    Record record;
    Eigen::Vector3d p_odom_body;
    std::optional<int32_t> edge_from_seq;
    double edge_m = 0;  // its length
  };

  void DropOne();

  SubmapStoreOptions options_;
  std::shared_ptr<RecordStore> records_;
  std::map<KeyframeId, Stored> keyframes_;
  std::map<KeyframeId, int32_t> lost_;  // last of a run -> its first seq
  std::deque<KeyframeId> in_memory_;    // in the order they came
  RecentCache<KeyframeId, KeyframeView> views_;
  RecordCounters counters_;
};

}  // namespace pangea
