#pragma once

// Place recognition on a bus. In: KEYFRAME_*, MAP_STATE. Out: one PLACE_MATCH per keyframe.
//
// Keyframes are processed in seq order, map by map (journal_follower.h). After a restart the
// process reads the journal's PLACE_MATCHes before its keyframes, or requests them together. A
// keyframe that has its match is only stored. A keyframe without one waits until all others are in,
// so that no pair of keyframes is missed, and until the pose graph has answered the request for the
// groups, which decide a candidate's kind. The process itself answers requests for the newest
// PLACE_MATCHes.
//
// A checkpoint covers the keyframes before the first one without a match in the journal.
//
// Live, keyframes are recognised one at a time, when no message waits: after a catch-up there may
// be many, and meanwhile group states must be received and requests answered.

#include <deque>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "bus/node.h"
#include "bus/process.h"
#include "journal_follower/journal_follower.h"
#include "messages/catch_up_messages.h"
#include "place_recognition/place_recognition.h"

namespace pangea {

class PlaceRecognitionProcess : public Process {
 public:
  // `records`: for corners, and for messages to retransmit (core/record_store.h).
  PlaceRecognitionProcess(Bus& bus, const PlaceRecognitionOptions& options,
                          const std::shared_ptr<RecordStore>& records = nullptr,
                          const CheckpointPlace& checkpoint = {});

  void Tick(int64_t now_utime) override;

 private:
  void OnKeyframe(const Keyframe& keyframe);
  bool OnKnownMatch(PlaceMatch match);
  void OnMapState(const MapState& state);
  void OnResendRequest(const ResendRequest& request);

  void Recognise(const Keyframe& keyframe);
  void ReleaseHeldIfCaughtUp();
  void RecogniseHeld();
  // Recognises the first held keyframe; returns whether more are held.
  bool RecogniseNext();
  void PublishStatus(int64_t now_utime);

  Node node_;
  std::shared_ptr<JournalRecords> records_;
  PlaceRecognition recognition_;
  JournalFollower journal_;
  bool was_catching_up_ = false;
  std::map<KeyframeId, PlaceMatch> known_matches_;   // from the journal; keyframe not seen yet
  std::deque<Keyframe> held_;                        // keyframes to be recognised, in order
  std::map<MapId, std::map<int32_t, Record>> sent_;  // newest of this run, to retransmit
};

}  // namespace pangea
