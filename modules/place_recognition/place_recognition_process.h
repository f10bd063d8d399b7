#pragma once

// place_recognition on a bus: KEYFRAME_* and MAP_STATE in, one PLACE_MATCH per keyframe out.
//
// Keyframes are taken in seq order, map by map (journal_follower.h). After a restart the journal's
// PLACE_MATCHes are read before its keyframes, or asked for along with them: a keyframe that has
// its match is only remembered, and those without one wait until all the others are in, so that no
// pair of keyframes goes unseen, and until the pose graph, which is asked for the groups, has said
// which maps are fused: a candidate's kind hangs on it. It answers requests for the newest
// PLACE_MATCHes itself.
//
// Live, keyframes are recognised one at a time, when no message waits: after a catch-up there may
// be many, and meanwhile groups are to be heard and requests answered.

#include <deque>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "bus/node.h"
#include "bus/process.h"
#include "bus/retransmission/journal_follower.h"
#include "messages/catch_up_messages.h"
#include "place_recognition/place_recognition.h"

namespace pangea {

class PlaceRecognitionProcess : public Process {
 public:
  // `records`: for corners, and messages to send again (core/record_store.h).
  PlaceRecognitionProcess(Bus& bus, const PlaceRecognitionOptions& options,
                          const std::shared_ptr<RecordStore>& records = nullptr);

  void Tick(int64_t now_utime) override;

 private:
  void OnKeyframe(const Keyframe& keyframe);
  bool OnKnownMatch(PlaceMatch match);
  void OnMapState(const MapState& state);
  void OnResendRequest(const ResendRequest& request);

  void Recognise(const Keyframe& keyframe);
  void ReleaseHeldIfCaughtUp();
  void RecogniseHeld();
  // The first that is held; whether more may follow.
  bool RecogniseNext();
  void PublishStatus(int64_t now_utime);

  Node node_;
  std::shared_ptr<RecordStore> records_;
  PlaceRecognition recognition_;
  JournalFollower journal_;
  bool was_catching_up_ = false;
  std::map<KeyframeId, PlaceMatch> known_matches_;  // of the journal, their keyframes still to come
  std::deque<Keyframe> held_;                       // without a match, in order
  std::map<MapId, std::map<int32_t, Record>> sent_;  // newest of this run, to send again
  int64_t next_status_utime_ = 0;
};

}  // namespace pangea
