#pragma once

// In: KEYFRAME_*, PLACE_MATCH (candidates of kind inter). Out: CONSTRAINT, STATUS_fusion.

#include <memory>

#include "fusion/fusion.h"
#include "loop_verification/candidate_process.h"

namespace pangea {

class FusionProcess : public CandidateProcess {
 public:
  FusionProcess(Bus& bus, const FusionOptions& options,
                const std::shared_ptr<RecordStore>& records = nullptr,
                const CheckpointPlace& checkpoint = {})
      : CandidateProcess(
            bus, "fusion", PlaceKind::kInter,
            [&options](const std::shared_ptr<RecordStore>& of_verifier) {
              return std::make_unique<Fusion>(options, of_verifier);
            },
            records, checkpoint) {}
};

}  // namespace pangea
