#pragma once

// The edits of anchors in the journal. Each (anchor, revision, editor) is journalled once, numbered
// from 0 on, published when it is kept (replication.h), and retransmitted on request.
//   server bus: ANCHOR_EDIT, AGAIN_<requester> out
//
// Bounds: kMaxEdits, with about 100 bytes of memory each, and kMaxRequests waiting requests.

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

  // Takes an event of the journal that is being opened. False if it is not a valid edit.
  bool Load(Bytes data, const JournalPlace& place);

  enum class Taken {
    kQueued,      // in the journal's queue; TakeJournalled returns it when it is kept
    kJournalled,  // a repeat of an edit that is kept
    kBusy,        // the journal's queue is full: the edit must be sent again
    kFull,        // there are kMaxEdits edits
  };
  // Gives the edit its number and appends it to the journal, unless it is a repeat. `utime`: wall
  // clock.
  Taken Take(AnchorEdit edit, int64_t utime, Journal* journal);
  // The first `num_edits` edits are kept now (replication.h). Publishes those that are new.
  void OnKept(int64_t num_edits);
  // The edits that became kept since the last call.
  std::vector<AnchorEdit> TakeJournalled() { return std::exchange(journalled_, {}); }
  // Publishes the newest edit again. From its seq a follower learns how many edits there are.
  void PublishNewest();

  // Returns why the request is refused, or an empty string. The request's map is ignored.
  std::string OnResendRequest(const resend_request_t& message);
  // Sends the next requested edit. Returns its size in bytes; 0 if there is no request.
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
  std::map<Key, int32_t> seq_of_;     // also of queued edits
  std::vector<JournalPlace> places_;  // by seq; size 0 if the edit was lost by damage
  int64_t next_seq_ = 0;
  int64_t kept_seq_ = 0;  // edits with a lower seq are kept
  std::vector<uint8_t> newest_;
  std::deque<Queued> queued_;
  std::vector<AnchorEdit> journalled_;
  std::deque<Request> requests_;
};

}  // namespace pangea
