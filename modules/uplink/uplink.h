#pragma once

// One agent's end of the link. Keyframes and poses go in, packets come out; acknowledgements go in,
// corrections and the acknowledged seqs come out. It asks the odometry for keyframes that it
// missed, so a restart of the uplink or a lost datagram on the agent's bus loses no keyframe that
// the odometry still has.
//
// A state machine: monotonic microseconds go in; no clock, no bus; not thread safe.

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
  double pose_hz = 10;  // largest rate of poses sent to the server; 0: none
  // Bound for all that the agent sends, with packet overhead and repeats; 0: no bound. To fit,
  // keyframes are thinned (ladder.h), and poses are sent less often.
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

// The options with bandwidth and pose rate reduced to fit the budget.
UplinkOptions WithinBudget(UplinkOptions options);
// The share of the budget for edits of anchors, bytes on the wire per second.
double AnchorBytesPerSecond(const UplinkOptions& options);

class Uplink {
 public:
  // `load` loads the keyframes for which SetStored was called.
  explicit Uplink(const UplinkOptions& options, Sender::Load load = nullptr);

  // The agent has published this keyframe. Returns whether it must still be added.
  bool NoteReceived(const KeyframeId& id, int64_t now_us);
  enum class Taken { kNew, kRepeat, kSpoolFull };
  // `bytes`: a keyframe_t that Parse has accepted, encoded and compressed.
  Taken AddKeyframe(const KeyframeId& id, std::vector<uint8_t> bytes, int64_t now_us);
  // From now on the keyframe can be loaded with `load`; also used for those of an earlier run.
  void SetStored(const KeyframeId& id);
  // `bytes`: the result of EncodePose. `group_revision`: of the correction applied to the pose.
  void AddPose(const MapId& map, int64_t group_revision, std::vector<uint8_t> bytes);
  // The new session may be with a handler that has another journal, with fewer keyframes. So what
  // the handler has is learnt again.
  void OnNewSession();
  void OnAck(const LinkAck& ack, int64_t now_us);

  // The packets to send now: only hellos until the first acknowledgement of the session.
  std::vector<LinkPacket> Poll(int64_t now_us);
  struct Ask {
    SeqGap gap;
    bool known = true;  // false: a probe whether there are keyframes that were never heard of
  };
  // The keyframes to ask the odometry for now. Each gap is asked for until it is filled or given
  // up.
  std::vector<Ask> Asks(int64_t now_us);
  // The number for a packet about anchors (uplink_anchors.h). Only while connected.
  int64_t NextNumber(int64_t now_us) { return sender_.NextNumber(now_us); }
  // The corrections to publish now: new ones, and once per second the current map's, until the
  // agent has applied it.
  std::vector<Correction> TakeCorrections(int64_t now_us);
  // The highest acknowledged seq of each map; -1: none.
  std::map<MapId, int32_t> Acknowledged() const;

  bool Connected(int64_t now_us) const;
  const Sender& sender() const { return sender_; }
  int64_t keyframes_acked() const { return keyframes_acked_; }
  int64_t keyframes_lost() const { return keyframes_lost_; }

 private:
  struct OutgoingMap {
    int32_t next = 0;             // the first seq that is neither journalled nor given up
    int32_t given_up = 0;         // earlier seqs are lost for good, unless they are journalled
    int32_t highest = -1;         // the highest seq that the agent is known to have published
    bool listed = false;          // the handler knows the map
    std::optional<uint8_t> slot;  // for hellos and pieces; set when the map is first in a hello
    int64_t asked_us = 0;
    int32_t asked_from = -1;
    int unanswered = 0;
    int probes = 0;           // since its last new keyframe, while it is not the current map
    int64_t received_us = 0;  // when the newest keyframe came
    std::optional<Correction> correction;
    bool confirms = false;         // the next hello must confirm the correction
    int64_t applied_revision = 0;  // from the agent's poses
    int64_t sent_us = 0;
  };

  OutgoingMap& FindOrAdd(const MapId& id);
  // The map that the odometry is in, as its poses say. Ids do not: the clock may have been set
  // back. Before the first pose, the map with the highest id. There must be a map.
  MapId Current() const { return current_.value_or(maps_.rbegin()->first); }
  void SetNext(const MapId& id, OutgoingMap* map, int32_t next);
  std::optional<SeqGap> Missing(const MapId& id, const OutgoingMap& map) const;
  // A probe for keyframes after the last known one of another map, or of maps before the first
  // known one. Each is probed a few times, with pauses.
  std::optional<SeqGap> ProbeOthers(int64_t now_us);
  bool HelloIsUrgent(int64_t now_us) const;
  bool GiveUp(const MapId& id, OutgoingMap* map, const SeqGap& gap);
  // The maps of the next hello, the current one last.
  std::vector<MapId> Announced() const;
  // Gives a slot to each map that has none, or that has the same as another one of these.
  void GiveSlots(const std::vector<MapId>& announced);
  // Whether the handler knows a map but not yet its slot.
  bool LacksSlot() const;
  std::vector<uint8_t> Hello();

  const UplinkOptions options_;
  Sender sender_;
  std::map<MapId, OutgoingMap> maps_;
  std::optional<MapId> current_;  // of the newest pose
  uint8_t next_slot_ = 0;
  int probes_of_start_ = 0;
  int64_t probed_others_us_ = 0;
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
