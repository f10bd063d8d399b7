#pragma once

// A client of NATS with JetStream over libnats, with the functions that the bridges need. Calls are
// synchronous; not thread safe. A call returns a failure if NATS does not answer within
// kTimeout_ms, or less, or there is no connection; it may then be repeated. The client reconnects
// by itself.

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "cluster/nats/nats_access.h"
#include "core/bytes.h"

namespace pangea {

class NatsClient {
 public:
  static constexpr int64_t kTimeout_ms = 2000;

  // Throws std::runtime_error, with the URL and advice, when nobody answers, we are refused, or
  // there is no JetStream.
  NatsClient(const NatsAccess& access, const std::string& name);
  ~NatsClient();
  NatsClient(const NatsClient&) = delete;
  NatsClient& operator=(const NatsClient&) = delete;

  bool connected() const;

  // Make a stream (stored in files), and a queue of its messages. An existing stream stays, but
  // gets the wanted number of replicas. They wait for a NATS cluster that has just been started,
  // and throw std::runtime_error.
  enum class Retention : uint8_t { kKept, kUntilAcknowledged, kNewestOfSubject };
  // `replicas` 0: keep the number; 1 for a new stream.
  void MakeStream(const std::string& stream, const std::string& subjects, Retention retention,
                  int replicas);
  // If a client fetches a message and then sends nothing about it for `ack_wait_us`, another client
  // gets it.
  void MakeQueue(const std::string& stream, const std::string& consumer, int64_t ack_wait_us);

  // A condition for Store: the newest message of the subject, or of the stream, must have this
  // sequence. If it has another one, Store returns kOtherwise.
  struct If {
    enum class What : uint8_t { kNewestOfSubject, kNewestOfStream } what = What::kNewestOfSubject;
    uint64_t sequence = 0;  // 0: there must be no message
  };
  enum class Stored : uint8_t { kNew, kOtherwise, kTooLarge, kUnreachable };
  struct StoreAnswer {
    Stored stored = Stored::kUnreachable;
    uint64_t sequence = 0;  // of the stored message in its stream, for kNew
  };
  // Stores a message if the condition holds. `utime` is stored with it; 0: none.
  StoreAnswer Store(const std::string& subject, Bytes data, const If& condition, int64_t utime = 0);

  struct Message {
    std::string subject;
    uint64_t sequence = 0;  // in its stream
    int64_t utime = 0;      // the `utime` given to Store
    std::vector<uint8_t> data;
  };
  // The newest message of this subject in the stream. Nothing if there is none, or NATS does not
  // answer.
  std::optional<Message> Find(const std::string& stream, const std::string& subject);
  // The stream's first message from `sequence` on whose subject matches `subjects`. Nothing as
  // above.
  std::optional<Message> Next(const std::string& stream, uint64_t sequence,
                              const std::string& subjects);

  // The subjects of all messages in the stream that match `subjects`. Nothing if NATS does not
  // answer.
  std::optional<std::vector<std::string>> Subjects(const std::string& stream,
                                                   const std::string& subjects);

  // The sequence of the stream's newest message, 0 if there is none, as the stream's leader knows
  // it. Nothing if there is no such stream, or it has no leader now.
  std::optional<uint64_t> LastSequence(const std::string& stream);

  struct Delivery {
    std::string ack_subject;   // for Acknowledge, InProgress and Nak
    int64_t stored_utime = 0;  // when it was stored, by the clock of NATS; 0: not known
    std::vector<uint8_t> data;
  };
  std::optional<Delivery> Fetch(const std::string& stream, const std::string& consumer);
  // The message is done and leaves the queue. False when NATS does not answer.
  bool Acknowledge(const std::string& ack_subject);
  void InProgress(const std::string& ack_subject);
  // Gives the message back to the queue. After `delay_us` any client may get it.
  void Nak(const std::string& ack_subject, int64_t delay_us = 0);

  struct QueueState {
    uint64_t waiting = 0;
    int64_t unacknowledged = 0;  // delivered and not acknowledged
  };
  std::optional<QueueState> StateOf(const std::string& stream, const std::string& consumer);

  // Publish reaches only clients that listen now, and may be lost. NextHeard does not wait;
  // `subject` as given to Listen. Publish may be called on any thread.
  void Publish(const std::string& subject, Bytes data);
  void Listen(const std::string& subject);
  struct Heard {
    std::string subject;  // without wildcards
    std::vector<uint8_t> data;
  };
  std::optional<Heard> NextHeard(const std::string& subject);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace pangea
