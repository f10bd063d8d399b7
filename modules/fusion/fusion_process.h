#pragma once

// Visual fusion of maps (the paper, section IV.D): verifies candidates of kind inter, with one
// verification result each. Maps are not merged here: the pose graph decides from the constraints
// which maps form a group.
//
// In: KEYFRAME_*, PLACE_MATCH (candidates of kind inter). Out: CONSTRAINT, STATUS_fusion.

#include <memory>

#include "loop_verification/candidate_process.h"

namespace pangea {

class FusionProcess : public CandidateProcess {
 public:
  FusionProcess(Bus& bus, const LoopVerifierOptions& options,
                const std::shared_ptr<RecordStore>& records = nullptr,
                const CheckpointPlace& checkpoint = {}, int threads = 1)
      : CandidateProcess(bus, "fusion", PlaceKind::kInter, options, records, checkpoint, threads) {}
};

}  // namespace pangea
