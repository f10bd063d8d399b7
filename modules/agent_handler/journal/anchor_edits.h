#pragma once

// Edits of anchors in the journal: each (anchor, revision, editor) once, numbered from 0 on,
// published once the disk has it, retransmitted to whoever asks.
//   server bus: ANCHOR_EDIT, AGAIN_<requester> out
//
// Bounds: kMaxEdits, of some 100 bytes each in memory; kMaxRequests wait.

#include <compare>
#include <cstdint>
#include <deque>
#include <map>
#include <string>
#include <vector>

#include "agent_handler/journal/journal.h"
#include "bus/node.h"
#include "core/anchor.h"
#include "pangea/resend_request_t.hpp"

namespace pangea {

class AnchorEdits {
 public:
  static constexpr int64_t kMaxEdits = 1'000'000;
  static constexpr size_t kMaxRequests = 50;

  explicit AnchorEdits(Node& node) : node_(node) {}

  // An event of a journal that is opened; false if it is no edit.
  bool Load(Bytes data, const JournalPlace& place);

  enum class Taken {
    kQueued,      // OnKept says when it is kept
    kJournalled,  // a repeat of what is kept
    kBusy,        // the disk is behind: it has to come again
    kFull,        // there are kMaxEdits
  };
  // Numbers it and appends it, unless it is a repeat. `utime`: wall clock.
  Taken Take(AnchorEdit edit, int64_t utime, Journal* journal);
  // The first so many edits are kept (replication.h): those that were not before are published.
  void OnKept(int64_t num_edits);
  // What OnKept found, each once.
  std::vector<AnchorEdit> TakeJournalled() { return std::exchange(journalled_, {}); }
  // The newest one once more: a follower sees by its seq how many there are.
  void PublishNewest();

  // Why it is refused, or an empty string. Its map is not read.
  std::string OnResendRequest(const resend_request_t& message);
  // Sends the next edit that was asked for; its bytes, 0 if none was.
  int64_t AnswerNext(const Journal& journal);
  size_t waiting() const { return requests_.size(); }

  int64_t num_edits() const { return next_seq_; }

 private:
  struct Key {
    int64_t created_utime, revision;
    uint16_t maker, editor;
    auto operator<=>(const Key&) const = default;
  };
  struct Queued {
    AnchorEdit edit;
    std::vector<uint8_t> bytes;
  };
  struct Request {
    std::string requester;
    int32_t next_seq;
    int32_t to_seq;
  };
  static Key KeyOf(const AnchorEdit& edit);
  void Index(const AnchorEdit& edit, const JournalPlace& place);

  Node& node_;
  std::map<Key, int32_t> seq_of_;     // also of those that are queued
  std::vector<JournalPlace> places_;  // by seq; of no size where damage has cost the edit
  int64_t next_seq_ = 0;
  int64_t kept_seq_ = 0;  // those below are kept
  std::vector<uint8_t> newest_;
  std::deque<Queued> queued_;
  std::vector<AnchorEdit> journalled_;
  std::deque<Request> requests_;
};

}  // namespace pangea
