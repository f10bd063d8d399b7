#pragma once

// One agent's end of the link: keyframes and poses in, packets out; acknowledgements in,
// corrections and "have up to" out. Asks the odometry for keyframes it missed, so a restarted
// uplink or a lost datagram on the agent's bus costs nothing the odometry still has.
//
// A state machine: time goes in (monotonic microseconds); no clock, no bus, one thread.

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "bus/retransmission/reorder_buffer.h"
#include "uplink/sender.h"

namespace pangea {

struct UplinkOptions {
  SenderOptions sender;
  double pose_hz = 10;  // poses sent up at most this often; 0 for none
  // What the agent may send, packets and repeats included; 0 for no bound. Keyframes are thinned to
  // fit (ladder.h), poses sent more seldom.
  double budget_kb_per_s = 0;
  int64_t spool_disk_bytes = 4'000'000'000;  // 40 hours of walking

  // Why the options cannot be used, or nothing.
  std::optional<std::string> Invalid() const;

  template <typename Archive>
  void Visit(Archive& archive) {
    archive.Add("bandwidth_kb_per_s", &sender.bandwidth_kb_per_s, {1, 1e6}, "kB/s",
                "of keyframes at most, repeats included");
    archive.Add("budget_kb_per_s", &budget_kb_per_s, {0, 1e6}, "kB/s",
                "of all that may be sent, 5 or more; keyframes are thinned to fit; 0: no bound");
    archive.Add("packet_bytes", &sender.payload_bytes, {kMinPayloadBytes, kMaxPayloadBytes}, "B",
                "of a keyframe in a packet; above the default a packet takes several frames");
    archive.Add("in_flight_bytes", &sender.max_in_flight_bytes, {kMaxPayloadBytes, 1 << 30}, "B",
                "sent and not yet acknowledged");
    archive.Add("pose_hz", &pose_hz, {0, 1000}, "Hz", "poses sent at most; 0: none");
    archive.Add("spool_memory_bytes", &sender.max_spool_bytes, {1e6, 1e12}, "B",
                "unacknowledged keyframes in memory; beyond it the newest are not taken");
    archive.Add("spool_disk_bytes", &spool_disk_bytes, {1e6, 1e15}, "B",
                "unacknowledged keyframes in the spool's folder; then memory");
  }
};

// With the pace and the poses that the budget allows.
UplinkOptions WithinBudget(UplinkOptions options);
// What it leaves for edits of anchors, bytes on the wire per second.
double AnchorBytesPerSecond(const UplinkOptions& options);

class Uplink {
 public:
  // `load` gives what SetStored was told of.
  explicit Uplink(const UplinkOptions& options, Sender::Load load = nullptr);

  // The agent has published it; whether it is still to be taken.
  bool NoteReceived(const KeyframeId& id, int64_t now_us);
  enum class Taken { kNew, kRepeat, kSpoolFull };
  // A keyframe_t that has passed Parse, encoded and compressed.
  Taken AddKeyframe(const KeyframeId& id, std::vector<uint8_t> bytes, int64_t now_us);
  // The keyframe can be loaded from now on; also one of an earlier run.
  void SetStored(const KeyframeId& id);
  // A pose in EncodePose's form; its map, and the revision of the correction it had applied.
  void AddPose(const MapId& map, int64_t group_revision, std::vector<uint8_t> bytes);
  // Perhaps with a handler that has another journal: what it has, it says anew, and it may be less.
  void OnNewSession();
  void OnAck(const LinkAck& ack, int64_t now_us);

  // Only hellos until the session's first acknowledgement.
  std::vector<LinkPacket> Poll(int64_t now_us);
  struct Ask {
    SeqGap gap;
    bool known = true;  // false: only looking whether there is more than was heard of
  };
  // What to ask of the odometry now; each gap is repeated until it is filled or given up.
  std::vector<Ask> Asks(int64_t now_us);
  // The number of a packet of anchors, which others make; only when connected.
  int64_t NextNumber(int64_t now_us) { return sender_.NextNumber(now_us); }
  // Corrections the agent has to be told now: new ones, and one per second it has not applied.
  std::vector<Correction> TakeCorrections(int64_t now_us);
  // The highest acknowledged seq of each map; -1 for none.
  std::map<MapId, int32_t> Acknowledged() const;

  bool Connected(int64_t now_us) const;
  bool Idle() const { return sender_.spooled() == 0; }
  const Sender& sender() const { return sender_; }
  int64_t keyframes_acked() const { return keyframes_acked_; }
  int64_t keyframes_lost() const { return keyframes_lost_; }

 private:
  struct OutgoingMap {
    int32_t next = 0;             // the first that is not journalled (or given up)
    int32_t given_up = 0;         // those before are lost for good, unless they are journalled
    int32_t highest = -1;         // the highest the agent is known to have published
    bool listed = false;          // the handler knows the map
    std::optional<uint8_t> slot;  // in hellos and pieces, since it was first in a hello
    int64_t asked_us = 0;
    int32_t asked_from = -1;
    int unanswered = 0;
    int probes = 0;           // since it was last heard of, while there is a newer one
    int64_t received_us = 0;  // when the newest keyframe came
    std::optional<Correction> correction;
    int64_t applied_revision = 0;  // as the agent's poses say
    int64_t sent_us = 0;
  };

  OutgoingMap& FindOrAdd(const MapId& id);
  void SetNext(const MapId& id, OutgoingMap* map, int32_t next);
  std::optional<SeqGap> Missing(const MapId& id, const OutgoingMap& map) const;
  // What may have come after the last known keyframe of a map that is not the newest, or before the
  // first known map; now and then, a few times.
  std::optional<SeqGap> ProbeOlder(int64_t now_us);
  bool HelloIsUrgent(int64_t now_us) const;
  bool GiveUp(const MapId& id, OutgoingMap* map, const SeqGap& gap);
  // The maps of the next hello, the newest last.
  std::vector<MapId> Announced() const;
  // Those that have no slot yet, or one that another of them has, get one.
  void GiveSlots(const std::vector<MapId>& announced);
  // The handler knows a map, but has still to be told its slot.
  bool LacksSlot() const;
  std::vector<uint8_t> Hello();

  const UplinkOptions options_;
  Sender sender_;
  std::map<MapId, OutgoingMap> maps_;
  uint8_t next_slot_ = 0;
  int probes_of_start_ = 0;
  int64_t probed_older_us_ = 0;
  int64_t newest_ack_ = 0;
  std::optional<int64_t> last_ack_us_;
  std::optional<int64_t> last_hello_us_;
  bool hello_due_ = true;
  std::vector<uint8_t> pose_;
  int64_t last_pose_us_ = 0;
  int64_t keyframes_acked_ = 0;
  int64_t keyframes_lost_ = 0;
};

}  // namespace pangea
