#pragma once

// In: KEYFRAME_*, PLACE_MATCH (candidates of kind intra). Out: CONSTRAINT, STATUS_inter_map_ba.

#include <memory>

#include "inter_map_ba/inter_map_ba.h"
#include "loop_verification/candidate_process.h"

namespace pangea {

class InterMapBaProcess : public CandidateProcess {
 public:
  InterMapBaProcess(Bus& bus, const InterMapBaOptions& options,
                    const std::shared_ptr<RecordStore>& records = nullptr,
                    const CheckpointPlace& checkpoint = {})
      : CandidateProcess(
            bus, "inter_map_ba", PlaceKind::kIntra,
            [&options](const std::shared_ptr<RecordStore>& of_verifier) {
              return std::make_unique<InterMapBa>(options, of_verifier);
            },
            records, checkpoint) {}
};

}  // namespace pangea
