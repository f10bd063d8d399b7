#pragma once

// The server's side of one agent (the paper, section IV.B): its communication module (receive
// cache, acknowledgements), its parser, and the manager of its submaps. Created by the agent's
// first session; packets come here once they are opened.
//
// A state machine: time goes in (monotonic microseconds); no clock, no bus, no file, one thread.

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "agent_handler/receiver.h"
#include "link/map_continuity.h"

namespace pangea {

class AgentHandler {
 public:
  AgentHandler(int32_t agent_id, const ReceiverOptions& options);

  // The journal already has this submap up to `journalled_seq`, but for `gaps`. What follows has to
  // go on from `newest`, which may be left out of an old one.
  void Resume(const MapId& map, int32_t journalled_seq, const std::vector<SeqGap>& gaps = {},
              const std::optional<Keyframe>& newest = std::nullopt);

  // The packets that follow are another run's of the uplink.
  void OnNewUplink();
  // Why it was refused, or an empty string.
  std::string OnPacket(const LinkPacket& packet);
  // Keyframes that are valid and next in their submap; say when the journal's disk has them.
  std::vector<Receiver::Keyframe> TakeReady();
  void Journalled(const KeyframeId& id);
  // The newest pose since the last call.
  std::optional<pose_t> TakePose() { return std::exchange(pose_, std::nullopt); }
  // Sent to the agent until it confirms; the highest revision of each submap wins.
  void OnCorrection(const Correction& correction);
  // The acknowledgement due now, if one is. Its number is the session's to give.
  std::optional<LinkAck> TakeAck(int64_t now_us);

  const std::string& software() const { return software_; }
  const Receiver& receiver() const { return receiver_; }

 private:
  struct SentCorrection {
    Correction correction;
    int64_t confirmed_revision = 0;
  };

  std::string OnHello(const LinkPacket& packet);
  std::string OnPiece(const LinkPacket& packet);
  std::string OnPose(const LinkPacket& packet);
  const Correction* Unconfirmed() const;

  const int32_t agent_id_;
  std::shared_ptr<MapContinuity> continuity_ = std::make_shared<MapContinuity>();
  Receiver receiver_;  // asks it
  std::string software_;
  bool has_uplink_ = false;
  int64_t highest_number_ = 0;
  std::array<std::optional<MapId>, 256> slots_;  // of this run's hellos
  std::optional<pose_t> pose_;
  std::map<MapId, SentCorrection> corrections_;
  int64_t last_ack_us_ = 0;
  int pieces_since_ack_ = 0;
  bool hello_since_ack_ = false;
  bool ack_urgent_ = false;
};

}  // namespace pangea
