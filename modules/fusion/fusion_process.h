#pragma once

// KEYFRAME_*, PLACE_MATCH (candidates of kind inter) in; CONSTRAINT, STATUS_fusion out.

#include "fusion/fusion.h"
#include "loop_verification/candidate_process.h"

namespace pangea {

class FusionProcess : public CandidateProcess {
 public:
  FusionProcess(Bus& bus, const FusionOptions& options,
                const std::shared_ptr<RecordStore>& records = nullptr)
      : CandidateProcess(bus, "fusion", PlaceKind::kInter,
                         std::make_unique<Fusion>(options, records), records) {}
};

}  // namespace pangea
