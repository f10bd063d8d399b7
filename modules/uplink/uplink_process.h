#pragma once

// The uplink process, between its agent's bus and the link bus.
//   agent bus: KEYFRAME_k, AGAIN_uplink_k, POSE_k in; HAVE, CORRECTION_k, LANDMARKS_k, OTHERS_k,
//              RESEND_REQUEST, STATUS_uplink_k out; and what uplink_anchors.h says
//   link bus:  LINK_DOWN_k in, LINK_UP_k out

#include <optional>
#include <set>
#include <string>
#include <vector>

#include "bus/node.h"
#include "link/map_continuity.h"
#include "link/poll_loop.h"
#include "uplink/ladder.h"
#include "uplink/spool.h"
#include "uplink/uplink.h"
#include "uplink/uplink_anchors.h"

namespace pangea {

class UplinkProcess : public PolledProcess {
 public:
  UplinkProcess(Bus& agent_bus, Bus& link_bus, int32_t agent_id, const SecretKey& key,
                const UplinkOptions& options, Spool* spool = nullptr,
                EditStore* edit_store = nullptr);

  int Poll(int64_t steady_us) override;
  void Tick(int64_t now_utime) override;
  // A summary of what was sent, acknowledged and is left, for people.
  std::string Totals() const;

 private:
  // Number of keyframes that the server has not acknowledged yet.
  int64_t num_waiting() const { return static_cast<int64_t>(uplink_.sender().spooled()); }
  void OnKeyframe(Bytes data);
  void OnPose(Bytes data);
  void OnLinkDown(Bytes data);
  // The keyframe's bytes to send: `data`, or those of a thinned keyframe that fits the budget.
  std::vector<uint8_t> FitBudget(const Keyframe& keyframe, Bytes data);
  void OnLandmarks(Bytes body);
  void OnOthers(const LinkPacket& packet);
  // Returns the packet's bytes on the wire.
  int64_t Send(const LinkPacket& packet);
  // Stores the keyframe on disk. False if the disk refuses; then StoreLeft tries again.
  bool Store(const KeyframeId& id, Bytes bytes);
  void StoreLeft();
  std::vector<uint8_t> Load(const KeyframeId& id);
  void PublishHave();
  void PublishAsks();
  void PublishCorrections();
  std::string RateForPeople();
  std::string StateForPeople();
  std::string SpoolForPeople() const;

  const int32_t agent_id_;
  Bus& link_bus_;
  Node node_;
  UplinkSession session_;
  MapContinuity continuity_;
  Spool* const spool_;
  std::set<KeyframeId> unstored_;  // those that the disk refused
  Uplink uplink_;
  UplinkAnchors anchors_;
  std::optional<RateLadder> ladder_;
  std::optional<int64_t> started_us_;  // the first Poll
  bool was_connected_ = false;
  int64_t bytes_up_ = 0;
  int64_t bytes_up_at_status_ = 0;
  double bytes_per_s_ = 0;  // rate of sending, smoothed over about ten seconds
  int64_t now_us_ = 0;
  int64_t now_utime_ = 0;
  int64_t next_have_us_ = 0;
  int64_t last_others_ = 0;  // number of the newest OTHERS packet of this session
  std::map<MapId, int32_t> last_have_;
};

}  // namespace pangea
