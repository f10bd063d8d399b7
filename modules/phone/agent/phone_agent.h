#pragma once

// A phone's agent whole: odometry and uplink on two buses inside it. Who owns it has the sensors,
// the clock, the network and the storage, and hands over what they give. The same class runs in a
// browser, in Node and in tests.
//
//   images, inertial samples, packets from the server ─► PhoneAgent ─► PhoneEvents
//
// No thread, clock, socket or file. Times: microseconds; `utime` of the sensors' clock, `now_us`
// since 1970 and never stepping (bus/wall_clock.h).

#include <cstdint>
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
#include "core/others.h"
#include "core/server_messages.h"
#include "messages/catch_up_messages.h"
#include "phone/agent/agent_config.h"
#include "phone/agent/drawn_anchors.h"
#include "phone/agent/odometry.h"
#include "uplink/uplink_process.h"

namespace pangea::phone {

struct PhonePose {
  int64_t utime = 0;  // of the image
  int8_t state = 0;   // pose_t's
  std::string reason;
  MapId map;
  Rigid3 T_odom_body;
  int num_tracked = 0;
  // Since the server's first correction of this map.
  struct InGroup {
    MapId group;  // its odom frame is the map frame
    Rigid3 T_map_body;
  };
  std::optional<InGroup> in_group;
};

// A keyframe to keep in storage until it is acknowledged, or not any more.
struct SpoolChange {
  std::string id;
  std::vector<uint8_t> bytes;  // empty: delete
};

// What has come out; as pose, statuses, anchors and others the newest alone.
struct PhoneEvents {
  std::vector<std::vector<uint8_t>> link_up;  // sealed packets, in their order
  std::optional<PhonePose> pose;
  std::optional<status_t> vio_status, uplink_status;  // vio: of either odometry
  std::optional<std::vector<DrawnAnchor>> anchors;
  std::optional<Others> others;
  std::vector<SpoolChange> spool;
  std::vector<std::vector<uint8_t>> keyframes;  // encoded keyframe_t, as they are finished
};

// A new anchor, at a pixel of the image of `utime`, or in the body at that time.
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
  // 8-bit grey, of the calibration's size; copied. `T_odom_body`: as of Odometry.
  void AddImage(int64_t utime, const cv::Mat& image,
                const std::optional<Rigid3>& T_odom_body = std::nullopt);
  void OnLinkDown(Bytes packet);
  // A keyframe that an earlier run has put in its spool; before the first image, in their order.
  // One that is damaged is deleted.
  void Restore(const std::string& id, Bytes bytes);
  // Throws std::runtime_error: it does not track, a field is out of its bounds.
  AnchorId PlaceAnchor(const NewAnchor& anchor);
  // Nothing when there is no such anchor.
  void RemoveAnchor(const AnchorId& id);
  // Every 10 to 20 ms.
  void Poll(int64_t now_us);
  // The sensors' time begins anew.
  void StartAnew();
  // No more images.
  void Flush();

  PhoneEvents Take();

 private:
  void Listen();
  void OnKeyframe(Bytes data);
  void OnPose(const pose_t& message);
  void Release(const Have& have);

  const int32_t agent_id_;
  const cv::Size image_size_;
  LocalBus agent_bus_;
  LocalBus link_bus_;
  Node node_;
  const std::unique_ptr<Odometry> odometry_;
  std::optional<UplinkProcess> uplink_;  // none without a key
  DrawnAnchors anchors_;
  std::optional<Correction> correction_;  // the newest one of the newest map
  std::optional<MapId> tracked_map_;      // while it tracks
  std::set<KeyframeId> spooled_;
  int64_t now_us_ = 0;
  int64_t next_tick_us_ = 0;
  int64_t last_created_utime_ = 0;  // of an anchor
  PhoneEvents events_;
};

}  // namespace pangea::phone
