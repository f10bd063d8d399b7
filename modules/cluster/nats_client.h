#pragma once

// NATS with JetStream, as much of it as the bridges need, over libnats. Calls are synchronous and
// for one thread; a call that NATS does not answer within kTimeout_ms, or while there is no
// connection, says so and changes nothing that a repeat would not. The connection is made again by
// itself.

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "bus/bus.h"
#include "cluster/nats_access.h"

namespace pangea {

class NatsClient {
 public:
  static constexpr int64_t kTimeout_ms = 2000;

  // Throws std::runtime_error with the URL and the mend when nobody answers there, we are refused,
  // or without JetStream.
  NatsClient(const NatsAccess& access, const std::string& name);
  ~NatsClient();
  NatsClient(const NatsClient&) = delete;
  NatsClient& operator=(const NatsClient&) = delete;

  bool connected() const;

  // Streams in files; one that exists stays, with as many replicas as wanted. A cluster of NATS
  // that has just been started is waited for. Throw std::runtime_error.
  enum class Retention : uint8_t { kKept, kUntilAcknowledged, kNewestOfSubject };
  // `replicas` 0: as it is, or 1.
  void MakeStream(const std::string& stream, const std::string& subjects, Retention retention,
                  int replicas);
  // Whoever fetches a message and says nothing of it for `ack_wait_us` has lost it to another.
  void MakeQueue(const std::string& stream, const std::string& consumer, int64_t ack_wait_us);

  // Stores a message if that is still so; else it is kOtherwise.
  struct If {
    enum class What : uint8_t { kNewestOfSubject, kNewestOfStream } what = What::kNewestOfSubject;
    uint64_t sequence = 0;  // of the newest one; 0: there is none
  };
  enum class Stored : uint8_t { kNew, kOtherwise, kTooLarge, kUnreachable };
  struct StoreAnswer {
    Stored stored = Stored::kUnreachable;
    uint64_t sequence = 0;  // of a new one, in its stream
  };
  // `utime`: goes with it; 0: none.
  StoreAnswer Store(const std::string& subject, Bytes data, const If& condition, int64_t utime = 0);

  struct Message {
    std::string subject;
    uint64_t sequence = 0;  // in its stream
    int64_t utime = 0;      // as it was stored with
    std::vector<uint8_t> data;
  };
  // The stream's message of this subject. Nothing: there is none, or NATS does not answer.
  std::optional<Message> Find(const std::string& stream, const std::string& subject);
  // Its first message from `sequence` on whose subject is among `subjects`.
  std::optional<Message> Next(const std::string& stream, uint64_t sequence,
                              const std::string& subjects);

  // Of all its messages whose subject is among `subjects`. Nothing: NATS does not answer.
  std::optional<std::vector<std::string>> Subjects(const std::string& stream,
                                                   const std::string& subjects);

  // The sequence of its newest message, 0 before the first, from who decides on what is stored
  // next. Nothing: there is no such stream, or nobody decides now.
  std::optional<uint64_t> LastSequence(const std::string& stream);

  struct Delivery {
    std::string ack_subject;   // where NATS is told what became of it
    int64_t stored_utime = 0;  // NATS' clock; 0: not known
    std::vector<uint8_t> data;
  };
  std::optional<Delivery> Fetch(const std::string& stream, const std::string& consumer);
  // Done, and out of the queue. False when NATS does not answer.
  bool Acknowledge(const std::string& ack_subject);
  void InProgress(const std::string& ack_subject);
  // Nobody gets it for so long; then another may.
  void Nak(const std::string& ack_subject, int64_t delay_us = 0);

  struct QueueState {
    uint64_t waiting = 0;
    int64_t unacknowledged = 0;  // delivered
  };
  std::optional<QueueState> StateOf(const std::string& stream, const std::string& consumer);

  // Best effort, to who listens now; one subject is listened to.
  void Publish(const std::string& subject, Bytes data);
  void Listen(const std::string& subject);
  std::optional<std::vector<uint8_t>> NextHeard();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace pangea
