#pragma once

// The server's journal and its service on the server bus. Keyframes, place matches, verification
// results and edits of anchors are each journalled once, announced (HAVE), and sent again to
// processes that lack them.
//   server bus: KEYFRAME_k (once the disk has it), HAVE, AGAIN_*, RESEND_REQUEST,
//               JOURNAL_FILE, VERDICT_REQUEST out, and what anchor_edits.h says;
//               PLACE_MATCH, CONSTRAINT, RESEND_REQUEST, VERDICT_REQUEST, AGAIN_<node's name>,
//               OPTIONS_*, JOURNAL_REPLICATED, JOURNAL_FILE of another server in
// The options of a process are journalled when it starts with other options than before.

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "agent_handler/journal/anchor_edits.h"
#include "agent_handler/journal/journal.h"
#include "agent_handler/journal/outstanding_results.h"
#include "agent_handler/journal/replication.h"
#include "agent_handler/journal/resend_queue.h"
#include "bus/node.h"
#include "link/pacer.h"
#include "messages/messages.h"
#include "pangea/again_t.hpp"
#include "pangea/resend_request_t.hpp"

namespace pangea {

class Archive {
 public:
  // Reads the journal; throws std::runtime_error if it cannot be used. `now_utime`: wall clock.
  // `replicated`: only what other hosts also have counts as kept (replication.h). `before_mend`:
  // as for Journal.
  Archive(Node& node, const std::string& journal_path, int64_t now_utime, bool replicated = false,
          const std::function<void()>& before_mend = nullptr);

  // Monotonic and wall clock; set them before the other calls.
  void set_now_us(int64_t steady_us) { now_us_ = steady_us; }
  void set_now_utime(int64_t utime) { now_utime_ = utime; }

  // While the journal's queue is full, nothing may be appended.
  bool Full() const { return journal_->Full(); }
  void Append(const KeyframeId& id, std::vector<uint8_t> bytes);
  AnchorEdits::Taken Append(AnchorEdit edit);
  // Writes the queue to the disk if it is time, and publishes the keyframes that are now on it.
  // Returns the keyframes that became kept since the last call.
  std::vector<KeyframeId> Sync();
  // The edits that became kept since the last call.
  std::vector<AnchorEdit> TakeJournalledEdits() { return anchor_edits_.TakeJournalled(); }
  void AnswerResendRequests();
  void PublishHave();
  // Asks for the matches and verification results that should be here by now.
  void RequestOutstanding();
  void SetCounters();

  // have(): the highest seq on the disk of each map. maps(): the maps in the journal's order.
  const std::map<MapId, int32_t>& have() const { return have_; }
  const std::vector<MapId>& maps() const { return by_age_; }
  // The map's keyframe with the highest seq, read from the disk; nothing if it cannot be read.
  std::optional<Keyframe> Newest(const MapId& map) const;
  // The keyframes of a map that its agent may send again: the map's gaps, if the journal was
  // damaged at the start.
  std::vector<SeqGap> Refillable(const MapId& map) const;
  // For people: the damage found at the start; empty if there was none.
  std::string Damage() const;
  bool busy() const {
    return journal_->HasUnsynced() || resend_queue_.waiting() + anchor_edits_.waiting() > 0;
  }
  bool disk_refuses() const { return disk_refuses_; }
  // Whether agents may be answered, and whether this agent's session may begin: have() must have
  // all of its keyframes.
  bool MayAnswer() const { return replication_->Works(now_us_); }
  bool MayJoin(int32_t agent_id) const;
  int64_t num_keyframes() const { return index_.num_keyframes(); }

 private:
  // A keyframe that is in the journal's queue, but not on the disk.
  struct Unsynced {
    KeyframeId id;
    std::vector<uint8_t> bytes;
    JournalPlace place;
  };

  void OnResendRequest(const resend_request_t& message);
  void OnVerificationRequest(const VerificationRequest& request);
  void OnRetransmission(const again_t& message);
  void OnOptions(const std::string& channel, Bytes data);
  void WriteDue();
  void PublishJournalFile();
  void OnJournalFile(const JournalFile& file);
  std::string JournalPath() const;
  void NoteJournalled(const KeyframeId& id);
  std::vector<SeqGap> Lost(const MapId& map) const;
  bool LoadEvent(const std::string& channel, Bytes data, const JournalPlace& place);
  bool LoadOptions(Bytes data);
  bool LoadAnchorEdit(Bytes data, const JournalPlace& place);
  // Answers are place matches and constraints. LoadAnswer takes one from the journal at the start,
  // OnAnswer a new one.
  template <typename Message>
  bool LoadAnswer(Bytes data, const JournalPlace& place);
  template <typename Message>
  void OnAnswer(const std::string& channel, Bytes data);

  Node& node_;
  JournalIndex index_;
  AnchorEdits anchor_edits_;
  std::unique_ptr<Journal> journal_;
  std::optional<Replication> replication_;
  std::deque<Unsynced> unsynced_;
  int64_t oldest_unsynced_us_ = 0;
  int64_t asks_for_gaps_until_utime_ = 0;
  std::map<MapId, int32_t> have_;
  std::vector<MapId> by_age_;
  std::map<std::string, ProcessOptions> options_in_force_;  // newest journalled ones by process
  OutstandingResults outstanding_;
  ResendQueue resend_queue_;
  Pacer resend_pacer_;
  int64_t now_us_ = 0;
  int64_t now_utime_ = 0;
  bool disk_refuses_ = false;
};

}  // namespace pangea
