#pragma once

// What a server process needs to follow the journal: keyframes, PLACE_MATCHes, verification results
// and edits of anchors reach it once they come, whether they were published, retransmitted, or
// written before it started. In: KEYFRAME_*, PLACE_MATCH, CONSTRAINT, ANCHOR_EDIT, HAVE,
// JOURNAL_FILE, AGAIN_<process>. Out: RESEND_REQUEST at ticks, for what a gap or HAVE tells of;
// once per map for the results of former runs; and for the states of maps that were there before
// this process. The time-outs: timeouts.h.
//
// The journal's file, where there is one on this host (journal_reader.h), is read when JOURNAL_FILE
// first tells of it: first all that a process made itself in former runs, then the rest, in the
// journal's order. Meanwhile nothing is asked for; what the file did not have is asked for after.
// It is read in pieces when no message waits (Bus::WorkWhenIdle); until then the process has no
// such work of its own (`reading`).
//
// A checkpoint (checkpoint/checkpoint_file.h) is what the process and its follower are when they
// have read the file up to some point, and nothing else: whoever restores it and reads the rest is
// where whoever read all of the file is. So none is made of a process at work: one that `writes`
// reads the file, makes the checkpoint and is done. It reads up to the first event that `completes`
// says no to. A checkpoint that cannot be used is told in one line, and all of the file is read.
//
// In order: keyframes come in seq order, map by map. Those that are lost (an edge or HAVE says so)
// are passed over and counted as dropped; with `gives_up` also those that nobody sends.
//
// A process is catching up while it reads the file, and while keyframes and matches are missing
// that the journal had of a map when this process knew nothing of it; for these not for longer than
// kCatchUpSilence_us without progress.
// When it first is not, the status says so: counter `ready_utime`, wall clock.
// Bounds: ReorderBuffer's. One thread; lives as long as its node.

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
#include "bus/retransmission/journal_reader.h"
#include "bus/retransmission/journal_records.h"
#include "bus/retransmission/missing.h"
#include "bus/retransmission/reorder_buffer.h"
#include "checkpoint/checkpoint_file.h"
#include "messages/anchor_messages.h"
#include "messages/catch_up_messages.h"
#include "pangea/again_t.hpp"

namespace pangea {

// Where a process has its checkpoint.
struct CheckpointPlace {
  std::filesystem::path file;  // empty: nowhere
  std::string options;         // that the process' state depends on
  bool writes = false;         // is here to write it
};

// What a process keeps in a checkpoint.
struct JournalCheckpoint {
  CheckpointPlace place;
  uint32_t format = 0;                            // of what `save` writes
  std::function<void(ByteWriter*)> save = {};     // after reading the file, so much of it
  std::function<bool(ByteReader*)> restore = {};  // all of that or nothing
  // Whether the process has what it makes of this keyframe or match itself.
  std::function<bool(const KeyframeId&)> keyframe_is_complete = {};
  std::function<bool(const PlaceMatch&)> match_is_complete = {};
};

class JournalFollower {
 public:
  // Of former runs: the process makes them itself, and is to know what it said before.
  enum class Which : uint8_t { kNone, kOfFormerRuns, kAll };

  struct Follows {
    bool in_order = false;  // keyframes
    bool gives_up = false;  // keyframes that nobody sends, of those in order
    Which matches = Which::kNone;
    Which results = Which::kNone;
    bool states = false;  // the process says by NoteStates which came
  };

  // Those that are empty are not called.
  struct Handlers {
    std::function<void(Keyframe)> keyframe = {};
    // One came, also where it waits for those before it.
    std::function<void(const KeyframeId&)> keyframe_came = {};
    // Whether it was taken; if not, it is asked for again.
    std::function<bool(PlaceMatch)> match = {};
    std::function<void(const Constraint&)> result = {};
    std::function<void(const Have&)> have = {};  // before what follows from it
    std::function<void(AnchorEdit)> anchor_edit = {};
    // What else of the journal is still to come, in a catch-up.
    std::function<int64_t()> more_to_catch_up = {};
    std::function<void()> handled = {};  // after each message
  };

  // `records`: where the process has the records of keyframes, which those of the file need not;
  // may be null.
  JournalFollower(Node& node, const Follows& follows, Handlers handlers,
                  JournalCheckpoint checkpoint = {},
                  std::shared_ptr<JournalRecords> records = nullptr);

  // At about 10 Hz. `ask_for_matches`: not while the process has no room for them.
  void Tick(int64_t now_utime, bool ask_for_matches = true);
  void NoteStates(const std::vector<MapId>& maps);

  bool catching_up() const {
    return (reading() && !stopped_) || !goal_.empty() || !states_.empty();
  }
  bool reading() const { return reader_ != nullptr; }
  // Keyframes (of the file about how many), maps' matches and what the process has to add.
  int64_t num_to_catch_up() const;
  // The process goes on with what it has; what the file still has comes nevertheless.
  void StopCatchingUp();

  // The map's first seq that did not come.
  int32_t next(const MapId& map) const { return keyframes_.next(map); }
  bool HasMatch(const KeyframeId& query) const { return matches_.Has(query.map, query.seq); }
  // Up to what seq the journal had the map, in a catch-up.
  std::optional<int32_t> Goal(const MapId& map) const;
  // Keyframes that wait for those before them.
  size_t num_buffered() const { return keyframes_.num_buffered(); }

 private:
  struct Waiting {
    Keyframe keyframe;
    std::optional<int64_t> event;  // of the file
  };
  // Nothing: a seq that will never come, or that was handed on out of order.
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
  // If the bytes are such a message and the process takes it.
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
  std::set<MapId> named_;         // maps that HAVE or the file told of
  std::set<MapId> early_states_;  // that came before the file's keyframes of these maps
  // What the journal had of each map when this process came, until that is in.
  std::map<MapId, int32_t> goal_;
  int64_t num_to_catch_up_ = 0;
  int64_t progress_utime_ = 0;             // when that fell last
  std::unique_ptr<JournalReader> reader_;  // while the file is read
  bool reads_former_runs_ = false;         // so far
  std::optional<int64_t> event_;           // of the file, that is being taken
  JournalState checkpoint_journal_;        // what of the file the checkpoint has
  bool file_known_ = false;
  bool stopped_ = false;
  bool have_received_ = false;
  bool ready_ = false;  // once, at least
};

}  // namespace pangea
