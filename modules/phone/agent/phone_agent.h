#pragma once

// A complete agent for a phone: odometry and uplink on two internal buses. Its owner has the
// sensors, the clock, the network and the storage, and passes their data in. The same class runs in
// a browser, in Node and in tests.
//
//   images, inertial samples, packets from the server ─► PhoneAgent ─► PhoneEvents
//
// No thread, clock, socket or file; not thread safe. Times are microseconds: `utime` by the
// sensors' clock, `now_us` since 1970, without steps (bus/wall_clock.h).

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "bus/bus.h"
#include "bus/node.h"
#include "core/anchor.h"
#include "core/camera_model.h"
#include "core/others.h"
#include "core/server_messages.h"
#include "messages/catch_up_messages.h"
#include "phone/agent/agent_config.h"
#include "phone/agent/drawn_anchors.h"
#include "phone/agent/odometry.h"
#include "phone/agent/stored_edits.h"
#include "uplink/uplink_process.h"

namespace pangea::phone {

struct PhonePose {
  int64_t utime = 0;  // of the image
  int8_t state = 0;   // pose_t.STATE_*
  std::string reason;
  MapId map;
  Rigid3 T_odom_body;
  int num_tracked = 0;
  // Set once the server has corrected this map.
  struct InGroup {
    MapId group;  // its odom frame is the map frame
    Rigid3 T_map_body;
  };
  std::optional<InGroup> in_group;
};

// The output since the last Take. Of poses, cameras, statuses, anchors and others only the newest
// is kept.
struct PhoneEvents {
  std::vector<std::vector<uint8_t>> link_up;  // sealed packets, in order
  std::optional<PhonePose> pose;
  // As the odometry has refined it, by the newest keyframe. What is drawn must agree with it.
  std::optional<CameraModel> camera;
  std::optional<status_t> vio_status, uplink_status;  // vio_status: of either odometry
  std::optional<std::vector<DrawnAnchor>> anchors;
  std::optional<Others> others;
  std::vector<SpoolChange> spool;
  std::vector<std::vector<uint8_t>> keyframes;  // encoded keyframe_t, newly finished
};

// A new anchor: on the surface behind a pixel of the image of `utime`, or relative to the body
// then.
struct NewAnchor {
  std::string name;
  std::string payload;
  int64_t utime = 0;
  std::optional<Eigen::Vector2d> pixel;
  Rigid3 T_body_anchor;
};

class PhoneAgent {
 public:
  explicit PhoneAgent(const AgentConfig& config);

  void AddImu(const ImuSample& sample) { odometry_->AddImu(sample); }
  // `image`: 8-bit grey, of the calibration's size; it is copied. `T_odom_body`: see Odometry.
  void AddImage(int64_t utime, const cv::Mat& image,
                const std::optional<Rigid3>& T_odom_body = std::nullopt);
  void OnLinkDown(Bytes packet);
  // Gives back a keyframe or an edit that an earlier run stored. Call it before the first image, in
  // the order in which they were stored. A damaged one is deleted (PhoneEvents::spool).
  void Restore(const std::string& id, Bytes bytes);
  // Throws std::runtime_error if there is no key, the odometry did not track that image, or a field
  // is out of bounds.
  AnchorId PlaceAnchor(const NewAnchor& anchor);
  // Does nothing if there is no such anchor.
  void RemoveAnchor(const AnchorId& id);
  // Call it every 10 to 20 ms.
  void Poll(int64_t now_us);
  // The sensors' time starts again: finishes the map; the next image opens another.
  void StartAnew();
  // No more images come: finishes the keyframes in the window.
  void Flush();

  PhoneEvents Take();

 private:
  // A map, and the times of its first and last tracked image.
  struct TrackedMap {
    MapId map;
    int64_t first_utime = 0, last_utime = 0;
  };
  static constexpr size_t kMaxTrackedMaps = 16;

  void Listen();
  void RefuseImage(int64_t utime, const cv::Size& size);
  void RestoreEdit(const std::string& id, Bytes bytes);
  void OnKeyframe(Bytes data);
  void OnPose(const pose_t& message);
  void NoteTracked(int64_t utime, const MapId& map);
  std::optional<MapId> MapAt(int64_t utime) const;
  void Release(const Have& have);

  const int32_t agent_id_;
  const cv::Size image_size_;
  LocalBus agent_bus_;
  LocalBus link_bus_;
  Node node_;
  const std::unique_ptr<Odometry> odometry_;
  PhoneEvents events_;
  StoredEdits edits_{&events_.spool};
  std::optional<UplinkProcess> uplink_;  // only with a key
  DrawnAnchors anchors_;
  MapId map_;                             // of the newest pose
  std::optional<Correction> correction_;  // the newest one of that map, or an earlier map's
  std::deque<TrackedMap> tracked_;        // the newest kMaxTrackedMaps, newest last
  std::set<KeyframeId> spooled_;
  int64_t now_us_ = 0;
  int64_t next_tick_us_ = 0;
  int64_t last_created_utime_ = 0;  // of the newest anchor made here
};

}  // namespace pangea::phone
