#pragma once

// A site's streams in NATS: its journal, the place matches that wait for a worker, the results of
// workers, and the lease that says which host is the core.
//   stream pangea-<site>-journal, subject pangea.<site>.journal.<channel>, of keyframes
//                                         pangea.<site>.journal.<channel>.<opened_utime>.<seq>
//   stream pangea-<site>-match,   subject pangea.<site>.match.<agent>.<opened_utime>.<seq>
//   stream pangea-<site>-result,  subject pangea.<site>.result.<agent>.<opened_utime>.<seq>.<id>
//   stream pangea-<site>-lease,   subject pangea.<site>.lease: the newest record counts
//   subject pangea.<site>.alive: the name of the lease's holder, while its bridge runs
//   subject pangea.<site>.have: the newest HAVE, only for clients that listen now
//   subject pangea.<site>.options.<process>: OPTIONS_<process> of workers
//   subject pangea.<site>.stored.<kind>: empty; somebody has stored a message (stream_watch.h)
// The journal's stream has all events of the site's journal in its order; one core at a time writes
// it (journal_shipper.h). Matches and results have the map and seq of the query, and <id> is the
// constraint's id. The data are LCM messages. A subject of a match or result has one message:
// storing it again has no effect, however much later. A match is removed when it is acknowledged.
// Not thread safe.

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "cluster/nats/nats_client.h"
#include "cluster/site_lease.h"
#include "core/keyframe.h"
#include "core/server_messages.h"

namespace pangea {

// The name, which becomes a part of subjects and stream names; throws std::runtime_error if it
// cannot.
std::string CheckedSite(const std::string& site);

class SiteStreams : public LeaseRecords {
 public:
  // If a worker is silent for this time, other workers get its matches.
  static constexpr int64_t kAckWait_us = 5'000'000;

  // Connects. Throws std::runtime_error.
  SiteStreams(const NatsAccess& access, const std::string& site);

  bool connected() const { return nats_.connected(); }
  // Makes the streams that do not exist; only a core does this. `replicas` 0: keep the number; 1
  // for new streams. Throws std::runtime_error.
  void Make(int replicas = 0, int64_t ack_wait_us = kAckWait_us);
  // Whether a core has made the streams.
  bool AreThere() { return nats_.LastSequence(Stream("result")).has_value(); }

  // What readers are told of when it is stored.
  enum class Kind : uint8_t { kKeyframe, kMatch, kResult };
  struct Entry {
    Kind kind = Kind::kMatch;
    std::string subject;
    std::vector<uint8_t> data;
  };
  Entry EntryOf(const PlaceMatch& match) const;
  Entry EntryOf(const Constraint& result) const;
  using Message = NatsClient::Message;
  using Stored = NatsClient::Stored;
  Stored Store(const Entry& entry);

  // The site's journal. An event is stored only if the newest one has the sequence `behind`. A term
  // (site_lease.h) is stored as an event of its own.
  using StoreAnswer = NatsClient::StoreAnswer;
  StoreAnswer StoreEvent(const std::string& channel, int64_t utime, Bytes data, uint64_t behind);
  StoreAnswer StoreTerm(uint64_t term, uint64_t behind);
  struct JournalEvent {
    uint64_t term = 0;  // not 0: a core began here, and this is not an event of the journal
    std::string channel;
    int64_t utime = 0;
    std::vector<uint8_t> data;
  };
  std::optional<JournalEvent> EventAt(uint64_t sequence);
  std::optional<uint64_t> JournalEnd() { return nats_.LastSequence(Stream("journal")); }
  std::optional<uint64_t> ResultsEnd() { return nats_.LastSequence(Stream("result")); }

  std::optional<uint64_t> LeaseSequence() override { return nats_.LastSequence(Stream("lease")); }
  std::optional<Message> FindLease() override;
  StoreAnswer StoreLease(const std::string& record, uint64_t behind) override;

  // Signs of life of the lease's holder (site_lease.h). PublishSign may be called on any thread.
  void PublishSign(const std::string& holder);
  void ListenToSigns() { nats_.Listen(SignSubject()); }
  std::optional<std::string> NextSign();

  // Nothing if the message is not there, or NATS does not answer.
  std::optional<Message> FindKeyframe(const KeyframeId& id);
  std::optional<Message> FindMatch(const KeyframeId& query);
  std::optional<Message> FindResult(const KeyframeId& query, int64_t constraint_id);

  // Reads a stream, or a part of its subjects, from the beginning.
  class Reader {
   public:
    // The next message. Nothing if there is none now, or NATS does not answer.
    std::optional<Message> Next();
    // Whether the reader is past the stream's message with this sequence.
    bool HasHad(uint64_t sequence) const { return next_ > sequence; }

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

  // The queue of matches (nats_client.h).
  using Delivery = NatsClient::Delivery;
  using QueueState = NatsClient::QueueState;
  std::optional<Delivery> FetchMatch();
  bool Acknowledge(const std::string& ack_subject) { return nats_.Acknowledge(ack_subject); }
  void InProgress(const std::string& ack_subject) { nats_.InProgress(ack_subject); }
  void Nak(const std::string& ack_subject, int64_t delay_us = 0);
  // The queries of this map whose match is in the queue, or taken and not acknowledged. Nothing if
  // NATS does not answer.
  std::optional<std::vector<KeyframeId>> PendingMatchesOf(const MapId& map);
  std::optional<QueueState> MatchQueueState();

  void ListenToStored(Kind kind) { nats_.Listen(StoredSubject(kind)); }
  // Whether somebody has stored such a message since the last call.
  bool HeardOfStored(Kind kind);
  void PublishHave(Bytes data);
  void ListenToHave();
  std::optional<NatsClient::Heard> NextHave() { return nats_.NextHeard(HaveSubject()); }
  void PublishOptions(const std::string& process, Bytes data);
  void ListenToOptions();
  std::optional<NatsClient::Heard> NextOptions() { return nats_.NextHeard(OptionsSubject("*")); }

 private:
  std::string Stream(const std::string& kind) const;
  std::string Subject(const std::string& kind, const std::string& rest) const;
  std::string Subject(const std::string& kind, const KeyframeId& id) const;
  std::string HaveSubject() const;
  std::string LeaseSubject() const;
  std::string SignSubject() const;
  std::string StoredSubject(Kind kind) const;
  std::string OptionsSubject(const std::string& process) const;

  const std::string site_;
  NatsClient nats_;
};

}  // namespace pangea
