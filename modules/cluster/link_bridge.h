#pragma once

// Carries the packets of the link between two link buses, over NATS: that of an edge host, where
// uplinks are, and that of the site's server. The packets are sealed between uplink and server, so
// an edge has no keys and keeps nothing: it may end at any time, and an uplink may come back at
// another edge and goes on where it was. NATS may lose packets, like any network; the link repeats
// them.
//   edge:   LINK_UP_k    ─► pangea.<site>.link.up.<k>;    pangea.<site>.link.down.*  ─► LINK_DOWN_k
//   server: LINK_DOWN_k  ─► pangea.<site>.link.down.<k>;  pangea.<site>.link.up.*    ─► LINK_UP_k
// The server's end sends only to agents whose packets came over NATS in the last kAway_us.

#include <cstdint>
#include <deque>
#include <map>
#include <string>
#include <unordered_set>

#include "bus/bus.h"
#include "bus/process.h"
#include "bus/status_log.h"
#include "cluster/nats/nats_client.h"

namespace pangea {

// The newest packets, to recognise one that comes a second time.
class RecentPackets {
 public:
  static constexpr size_t kKept = 4096;

  // False if the packet is one of the last kKept.
  bool Add(Bytes packet);

 private:
  std::deque<size_t> hashes_;
  std::unordered_set<size_t> known_;
};

class LinkBridge : public Process {
 public:
  enum class End : uint8_t { kEdge, kServer };
  static constexpr int64_t kAway_us = 10'000'000;

  // Throws std::runtime_error when NATS refuses.
  LinkBridge(Bus& link_bus, NatsClient& nats, const std::string& site, End end);

  void Tick(int64_t now_utime) override;
  void BetweenMessages(int64_t now_utime) override;
  int longest_wait_ms() const override;

  // Packets taken from the bus and from NATS, and those that came back: then both ends are on one
  // link bus.
  struct Counters {
    int64_t from_bus = 0, from_nats = 0, echoes = 0;
  };
  const Counters& counters() const { return counters_; }

 private:
  std::string SubjectOf(const char* direction, const std::string& agent) const;
  void OnPacket(const std::string& channel, Bytes packet);
  bool IsWanted(int32_t agent_id) const;
  std::string State() const;

  Bus& link_bus_;
  NatsClient& nats_;
  const std::string site_;
  const End end_;
  const std::string heard_prefix_, heard_subject_;
  RecentPackets recent_;
  Counters counters_;
  std::map<int32_t, int64_t> heard_utime_;  // by agent: when a packet last came over NATS
  int64_t now_utime_ = 0;
  int64_t active_utime_ = 0;  // when a packet last came, from either side
  StateChanges changes_;
};

}  // namespace pangea
