#pragma once

// The uplink between its agent's bus and the link bus.
//   agent bus: KEYFRAME_k, AGAIN_uplink_k, POSE_k in; HAVE, CORRECTION_k, RESEND_REQUEST,
//              STATUS_uplink_k out
//   link bus:  LINK_DOWN_k in, LINK_UP_k out

#include <string>

#include "common/bus/node.h"
#include "common/link/poll_loop.h"
#include "uplink/uplink.h"

namespace pangea {

class UplinkProcess : public PolledProcess {
 public:
  UplinkProcess(Bus& agent_bus, Bus& link_bus, int32_t agent_id, const SecretKey& key,
                const UplinkOptions& options);

  int Poll(int64_t steady_us) override;
  void Tick(int64_t now_utime) override;

 private:
  void OnKeyframe(Bytes data);
  void OnPose(Bytes data);
  void OnLinkDown(Bytes data);
  void Send(const LinkPacket& packet);
  void PublishHave();
  void PublishAsks();
  void PublishCorrections();

  const int32_t agent_id_;
  Bus& link_bus_;
  Node node_;
  UplinkSession session_;
  Uplink uplink_;
  int64_t now_us_ = 0;
  int64_t next_have_us_ = 0;
  int64_t next_status_utime_ = 0;
  std::map<MapId, int32_t> last_have_;
};

}  // namespace pangea
