#pragma once

// Loop closures within one map (the paper, section IV.C): verifies candidates of kind intra, with
// one verification result each. The steps are those of fusion: PnP, then bundle adjustment of the
// windows up to both keyframes. In addition, the drift that the loop implies must be possible for
// odometry over that path (drift_gate.h).
//
// In: KEYFRAME_*, PLACE_MATCH (candidates of kind intra). Out: CONSTRAINT, STATUS_inter_map_ba.

#include <memory>

#include "loop_verification/candidate_process.h"

namespace pangea {

class InterMapBaProcess : public CandidateProcess {
 public:
  InterMapBaProcess(Bus& bus, const LoopVerifierOptions& options,
                    const std::shared_ptr<RecordStore>& records = nullptr,
                    const CheckpointPlace& checkpoint = {}, int threads = 1)
      : CandidateProcess(bus, "inter_map_ba", PlaceKind::kIntra, options, records, checkpoint,
                         threads) {}
};

}  // namespace pangea
