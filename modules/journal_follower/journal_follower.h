#pragma once

// Lets a server process follow the journal: it gets keyframes, PLACE_MATCHes, verification results
// and edits of anchors, whether they are published, retransmitted, or were written before the
// process started. In: KEYFRAME_*, PLACE_MATCH, CONSTRAINT, ANCHOR_EDIT, HAVE, JOURNAL_FILE,
// AGAIN_<process>. Out: RESEND_REQUEST, for messages that a gap or HAVE shows to be missing, for
// the results of former runs (once per map), and for the states of maps that are older than this
// process. timeouts.h has the time-outs.
//
// File: if the journal's file is on this host (journal_reader.h), the first JOURNAL_FILE starts
// reading it. First come the process' own results of former runs, then the rest in the journal's
// order. Nothing is asked for until the end of the file. The file is read in pieces while no
// message waits (Bus::WorkWhenIdle); while `reading`, the process must give no such work itself.
//
// Checkpoint (checkpoint/checkpoint_file.h): the state of the process and its follower when they
// have read the file up to some point, and nothing else. Restoring it and reading the rest gives
// the same state as reading all of the file. So a running process never makes one: a process
// started with `writes` reads the file, makes the checkpoint and ends. It reads up to the first
// event that keyframe_is_complete or match_is_complete refuses. If a checkpoint cannot be used, one
// line of the log says so, and all of the file is read.
//
// Order: with `in_order`, keyframes of a map come in seq order. Lost keyframes (an edge or HAVE
// says so) are skipped and counted as dropped; with `gives_up` also those that nobody sends.
//
// Catching up: a process catches up while it reads the file, while states are missing, and while
// keyframes or matches are missing that the journal already had when the process learnt of their
// map. The latter ends after kCatchUpSilence_us without progress. When the process is first done,
// its status gets the counter `ready_utime` (wall clock).
//
// Memory is bounded by ReorderBuffer. Used on one thread; `node` must outlive it.

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "bus/node.h"
#include "bus/retransmission/gap_requests.h"
#include "bus/retransmission/missing.h"
#include "bus/retransmission/reorder_buffer.h"
#include "checkpoint/checkpoint_file.h"
#include "journal_follower/journal_reader.h"
#include "journal_follower/journal_records.h"
#include "messages/anchor_messages.h"
#include "messages/catch_up_messages.h"
#include "pangea/again_t.hpp"

namespace pangea {

// The place and mode of a process' checkpoint.
struct CheckpointPlace {
  std::filesystem::path file;  // empty: no checkpoint
  std::string options;         // the options on which the process' state depends
  bool writes = false;         // the process was started only to write the checkpoint
};

// How a process saves its state to a checkpoint, and restores it.
struct JournalCheckpoint {
  CheckpointPlace place;
  uint32_t format = 0;                            // version of the format that `save` writes
  std::function<void(ByteWriter*)> save = {};     // saves the state after reading the file
  std::function<bool(ByteReader*)> restore = {};  // false: the state is unchanged
  // Whether the file has the process' own results of this keyframe or match. Null: always.
  std::function<bool(const KeyframeId&)> keyframe_is_complete = {};
  std::function<bool(const PlaceMatch&)> match_is_complete = {};
};

class JournalFollower {
 public:
  // Which messages of a kind the process gets. kOfFormerRuns is for messages that the process
  // itself publishes: it gets those of its former runs.
  enum class Which : uint8_t { kNone, kOfFormerRuns, kAll };

  struct Follows {
    bool in_order = false;  // keyframes come in seq order
    bool gives_up = false;  // with in_order: skip keyframes that nobody sends
    Which matches = Which::kNone;
    Which results = Which::kNone;
    bool states = false;  // ask for MAP_STATEs; the process calls NoteStates for each that comes
  };

  // Empty handlers are not called.
  struct Handlers {
    std::function<void(Keyframe)> keyframe = {};
    // A keyframe arrived; it may still wait for those before it.
    std::function<void(const KeyframeId&)> keyframe_came = {};
    // Returns whether the process took the match. If not, the match is asked for again.
    std::function<bool(PlaceMatch)> match = {};
    std::function<void(const Constraint&)> result = {};
    std::function<void(const Have&)> have = {};  // called before the follower uses the HAVE
    std::function<void(AnchorEdit)> anchor_edit = {};
    // In a catch-up: how many more items of the journal the process itself still waits for.
    std::function<int64_t()> more_to_catch_up = {};
    std::function<void()> handled = {};  // called after each message
  };

  // `records`: the process' store of keyframe records; may be null. It gets the file, so that it
  // need not store the file's keyframes again.
  JournalFollower(Node& node, const Follows& follows, Handlers handlers,
                  JournalCheckpoint checkpoint = {},
                  std::shared_ptr<JournalRecords> records = nullptr);

  // Call it at about 10 Hz. `ask_for_matches`: false while the process has no room for matches.
  void Tick(int64_t now_utime, bool ask_for_matches = true);
  void NoteStates(const std::vector<MapId>& maps);

  bool catching_up() const {
    return (reading() && !stopped_) || !goal_.empty() || !states_.empty();
  }
  bool reading() const { return reader_ != nullptr; }
  // How much is still missing in a catch-up: keyframes (an estimate for the file), maps that lack
  // matches, and what more_to_catch_up adds.
  int64_t num_to_catch_up() const;
  // Ends the catch-up: the process works with what it has. The rest of the file is still read.
  void StopCatchingUp();

  // The first seq of the map that is still missing.
  int32_t next(const MapId& map) const { return keyframes_.next(map); }
  bool HasMatch(const KeyframeId& query) const { return matches_.Has(query.map, query.seq); }
  // In a catch-up: the highest seq that the journal had of the map when the process learnt of it.
  std::optional<int32_t> Goal(const MapId& map) const;
  // Number of keyframes that wait for those before them.
  size_t num_buffered() const { return keyframes_.num_buffered(); }

 private:
  struct Waiting {
    Keyframe keyframe;
    std::optional<int64_t> event;  // offset in the file, if it came from there
  };
  // Without value: this seq will never come, or was already handed on out of order.
  using Item = std::optional<Waiting>;

  void OnKeyframe(Keyframe keyframe);
  void OnMatch(PlaceMatch match);
  void OnResult(const Constraint& result);
  void OnHave(const Have& have);
  void OnRetransmission(const again_t& again);

  void OnJournalFile(const JournalFile& file);
  bool ReadPiece();
  void EndReading();
  void TakeOfFormerRuns(const std::string& channel, Bytes data);
  bool TakeOfFile(const std::string& channel, Bytes data, int64_t offset);
  bool MayBeKept(const Keyframe& keyframe) const;
  void RestoreCheckpoint();
  bool RestoreFollower(ByteReader* reader);
  void WriteCheckpoint();
  void SaveFollower(ByteWriter* writer) const;
  // Calls the handler if the bytes are a valid message of this type.
  template <typename Message, typename Handler>
  void TakeBytes(Bytes data, const Handler& handler);
  void NoteMapOfFile(const MapId& map);
  void TakeNewMap(const MapId& map, int32_t highest_seq);
  void HandOn(Waiting waiting);
  void AddInOrder(Keyframe keyframe);
  void Lose(const SeqGap& gap);
  void Skip(const SeqGap& gap);
  void HandOn(std::vector<Item> ready);
  void Handled();
  void AskForKeyframes(int64_t now_utime);
  int64_t NumMissing() const;
  void CatchUp(int64_t now_utime);
  void NoteReady(int64_t now_utime);

  Node& node_;
  const Follows follows_;
  const Handlers handlers_;
  const JournalCheckpoint checkpoint_;
  const std::shared_ptr<JournalRecords> records_;
  ReorderBuffer<Item> keyframes_;
  GapRequests keyframe_requests_;
  MissingMessages matches_;
  MissingStates states_;
  std::set<MapId> named_;         // maps known from HAVE or the file
  std::set<MapId> early_states_;  // maps whose states came while the file was read
  // Highest seq that the journal had of each map when this process learnt of it; until all came.
  std::map<MapId, int32_t> goal_;
  int64_t num_to_catch_up_ = 0;
  int64_t progress_utime_ = 0;             // when num_to_catch_up_ last fell
  std::unique_ptr<JournalReader> reader_;  // null unless the file is being read
  bool reads_former_runs_ = false;         // the first of the two passes over the file
  std::optional<int64_t> event_;           // offset of the file's event that is being handled
  JournalState checkpoint_journal_;        // state of the journal in the restored checkpoint
  bool file_known_ = false;
  bool stopped_ = false;
  bool have_received_ = false;
  bool ready_ = false;  // ready_utime is set
};

}  // namespace pangea
