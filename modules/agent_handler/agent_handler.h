#pragma once

// The server's side of one agent (the paper, section IV.B): communication (receive cache,
// acknowledgements), parsing, and management of the agent's maps (the paper's submaps). It is
// created by the agent's first session, and gets packets after they are decrypted.
//
// A state machine: monotonic microseconds go in; no clock, no bus, no file; not thread safe.

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

  // The journal already has this map up to `journalled_seq`, except for `gaps`. New keyframes must
  // continue `newest` (MapContinuity), which may be missing for an old map.
  void Resume(const MapId& map, int32_t journalled_seq, const std::vector<SeqGap>& gaps = {},
              const std::optional<Keyframe>& newest = std::nullopt);

  // The packets that follow come from another run of the uplink.
  void OnNewUplink();
  // Returns why the packet was refused, or an empty string.
  std::string OnPacket(const LinkPacket& packet);
  // The keyframes that are valid and next in their map. Call Journalled for each of them when it is
  // on the journal's disk.
  std::vector<Receiver::Keyframe> TakeReady();
  void Journalled(const KeyframeId& id);
  // The newest pose received since the last call.
  std::optional<pose_t> TakePose() { return std::exchange(pose_, std::nullopt); }
  // The correction is sent to the agent until it confirms it. Of two corrections of a map the one
  // with the higher revision is used.
  void OnCorrection(const Correction& correction);
  // The acknowledgement to send now, if one is due. The session gives it its number.
  std::optional<LinkAck> TakeAck(int64_t now_us);
  // Whether something came for which no ack was sent.
  bool OwesAck() const { return ack_urgent_ || hello_since_ack_ || pieces_since_ack_ > 0; }

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
  Receiver receiver_;  // uses continuity_
  std::string software_;
  bool has_uplink_ = false;
  int64_t highest_number_ = 0;
  std::array<std::optional<MapId>, 256> slots_;  // from the hellos of the current uplink run
  std::optional<pose_t> pose_;
  MapId current_;  // the last map of the newest hello: the agent is in it
  std::map<MapId, SentCorrection> corrections_;
  int64_t last_ack_us_ = 0;
  int pieces_since_ack_ = 0;
  bool hello_since_ack_ = false;
  bool ack_urgent_ = false;
};

}  // namespace pangea
