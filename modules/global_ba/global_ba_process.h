#pragma once

// In: KEYFRAME_*, PLACE_MATCH, CONSTRAINT, MAP_STATE, RESEND_REQUEST. Out: REFINEMENT,
// STATUS_global_ba.
//
// Works while the bus is quiet: three seconds after the last message a group is adjusted, in
// pieces. Messages are handled between the pieces; the adjustment is abandoned if they change its
// input. So it takes no computing time from a running session. A replay calls Finish.
//
// Whoever requests a MAP_STATE gets the group's last REFINEMENT again too, at the next tick.
//
// Missing messages are requested (journal_follower.h). If a verification result is lost for good,
// only its corner matches are missing.

#include <memory>
#include <set>
#include <utility>

#include "bus/node.h"
#include "bus/process.h"
#include "global_ba/global_ba.h"
#include "journal_follower/journal_follower.h"
#include "messages/catch_up_messages.h"
#include "messages/state_chunks.h"
#include "pangea/map_state_t.hpp"

namespace pangea {

class GlobalBaProcess : public Process {
 public:
  // `records`: stores keyframes and matches (core/record_store.h).
  GlobalBaProcess(Bus& bus, const GlobalBaOptions& options,
                  const std::shared_ptr<RecordStore>& records = nullptr,
                  const CheckpointPlace& checkpoint = {});

  void Tick(int64_t now_utime) override;
  // Adjusts every group that is due, to the end. The pose graph's answers may give more to do.
  void Finish();
  bool HasWork() const { return global_ba_.HasWork(); }

 private:
  void Save(ByteWriter* writer) const;
  bool Restore(ByteReader* reader);
  template <typename Input>
  void Take(Input&& input) {
    ++num_inputs_;
    global_ba_.Take(std::forward<Input>(input));
  }
  void OnMapState(MapState state, const map_state_t& message);
  void OnResendRequest(const ResendRequest& request);

  void Advance();
  void Publish(const MapState& refined);
  void PublishStatus(int64_t now_utime);

  Node node_;
  std::shared_ptr<JournalRecords> records_;
  GlobalBa global_ba_;
  JournalFollower journal_;
  StateChunks chunks_;
  std::set<MapId> requested_;  // groups whose refinement is to be published again
  int64_t num_inputs_ = 0;
  int64_t num_inputs_at_change_ = 0;
  int64_t last_input_utime_ = 0;
};

}  // namespace pangea
