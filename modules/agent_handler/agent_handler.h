#pragma once

// The server's side of one agent (paper, IV.A): its communication module (receive cache,
// acknowledgements), its parser, and the manager of its submaps. Created by the agent's hello.
//
// A state machine: time goes in (monotonic microseconds); no clock, no bus, no file, one thread.

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/link/receiver.h"

namespace pangea {

class AgentHandler {
 public:
  // `run`: wall clock at the handler process' start, microseconds.
  AgentHandler(int32_t agent_id, int64_t run, const ReceiverOptions& options);

  // The journal already has this submap up to `journalled_seq`.
  void Resume(const MapId& map, int32_t journalled_seq);

  // Why it was refused, or an empty string.
  std::string OnPacket(const LinkPacket& packet, int64_t now_us);
  // Keyframes that are valid and next in their submap; say when the journal's disk has them.
  std::vector<Receiver::Keyframe> TakeReady() { return receiver_.TakeReady(); }
  void Journalled(const KeyframeId& id);
  // The newest pose_t's bytes since the last call; empty if there is none.
  std::vector<uint8_t> TakePose() { return std::exchange(pose_, {}); }
  // Told to the agent until it confirms; the highest revision of each submap wins.
  void OnCorrection(const Correction& correction);
  // The acknowledgement due now, if one is.
  std::optional<LinkAck> TakeAck(int64_t now_us);

  const std::string& software() const { return software_; }
  const Receiver& receiver() const { return receiver_; }

 private:
  struct Told {
    Correction correction;
    int64_t confirmed_revision = 0;
  };

  std::string OnHello(const LinkPacket& packet);
  std::string OnPose(const LinkPacket& packet);
  std::string CheckRun(const LinkPacket& packet, int64_t now_us);
  const Correction* Unconfirmed() const;

  const int32_t agent_id_;
  const int64_t run_;
  Receiver receiver_;
  std::string software_;
  int64_t uplink_run_ = 0;
  int64_t highest_number_ = 0;
  int64_t last_packet_us_ = 0;
  std::vector<uint8_t> pose_;
  std::map<MapId, Told> corrections_;
  int64_t acks_ = 0;
  int64_t last_ack_us_ = 0;
  int packets_since_ack_ = 0;
  bool ack_urgent_ = false;
};

}  // namespace pangea
