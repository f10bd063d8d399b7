#pragma once

// A site's streams in NATS: keyframes, place matches that wait for a worker, verification results.
//   stream pangea-<site>-keyframe, subject pangea.<site>.keyframe.<agent>.<opened_utime>.<seq>
//   stream pangea-<site>-match,    subject pangea.<site>.match.<agent>.<opened_utime>.<seq>
//   stream pangea-<site>-result,   subject pangea.<site>.result.<agent>.<opened_utime>.<seq>.<id>
//   subject pangea.<site>.have: the newest HAVE, to who listens
// The map and seq of matches and results are the query's; <id> is the constraint's. The bytes are
// LCM's. A subject has one message: what is stored again is not stored twice, however much later.
// A match goes when it is acknowledged. One thread.

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "cluster/nats_client.h"
#include "core/keyframe.h"
#include "core/server_messages.h"

namespace pangea {

class SiteStreams {
 public:
  // A worker that is silent for so long has lost its matches to others.
  static constexpr int64_t kAckWait_us = 5'000'000;

  // Connects, and makes the streams that are not there. Throws std::runtime_error.
  SiteStreams(const std::string& nats_url, const std::string& site,
              int64_t ack_wait_us = kAckWait_us);

  bool connected() const { return nats_.connected(); }

  struct Entry {
    std::string subject;
    std::vector<uint8_t> data;
  };
  Entry EntryOf(const Keyframe& keyframe) const;
  Entry EntryOf(const PlaceMatch& match) const;
  Entry EntryOf(const Constraint& result) const;
  using Stored = NatsClient::Stored;
  Stored Store(const Entry& entry) { return nats_.Store(entry.subject, entry.data); }

  // Nothing: it is not there, or NATS does not answer.
  using Message = NatsClient::Message;
  std::optional<Message> FindKeyframe(const KeyframeId& id);
  std::optional<Message> FindResult(const KeyframeId& query, int64_t constraint_id);

  // Follows a stream, or a part of it, from its beginning.
  class Reader {
   public:
    // Nothing: no more is there now, or NATS does not answer.
    std::optional<Message> Next();

   private:
    friend class SiteStreams;
    Reader(NatsClient& nats, std::string stream, std::string subjects)
        : nats_(&nats), stream_(std::move(stream)), subjects_(std::move(subjects)) {}
    NatsClient* nats_;
    std::string stream_;
    std::string subjects_;
    uint64_t next_ = 1;
  };
  Reader Keyframes();
  Reader Results();
  Reader ResultsOf(const MapId& map);

  // Of the queue of matches (nats_client.h).
  using Taken = NatsClient::Taken;
  using Queue = NatsClient::Queue;
  std::optional<Taken> TakeMatch();
  bool Acknowledge(const std::string& claim) { return nats_.Acknowledge(claim); }
  void StillWorking(const std::string& claim) { nats_.StillWorking(claim); }
  void GiveBack(const std::string& claim) { nats_.GiveBack(claim); }
  std::optional<Queue> LookAtQueue();

  void PublishHave(Bytes data);
  void ListenToHave();
  std::optional<std::vector<uint8_t>> NextHave() { return nats_.NextHeard(); }

 private:
  std::string Stream(const std::string& kind) const;
  std::string Subject(const std::string& kind, const std::string& rest) const;
  std::string Subject(const std::string& kind, const KeyframeId& id) const;
  std::string HaveSubject() const;

  const std::string site_;
  NatsClient nats_;
};

}  // namespace pangea
