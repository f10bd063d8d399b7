#include <memory>

#include "bus/process_main.h"
#include "fusion/fusion_process.h"

// KEYFRAME_*, PLACE_MATCH --> FusionProcess --> CONSTRAINT
int main(int argc, char** argv) {
  pangea::FusionOptions options;
  pangea::ScratchFileOptions scratch;
  pangea::CheckpointPlace checkpoint;
  pangea::YamlOptions yaml;
  options.Visit(yaml);
  return pangea::ProcessMain(
      argc, argv,
      {"pangea-fusion", "Aligns maps: a verification result for every place match between two maps",
       yaml, &scratch, &checkpoint},
      [&](pangea::Bus& bus) {
        return std::make_unique<pangea::FusionProcess>(
            bus, options, std::make_shared<pangea::ScratchFile>(scratch), checkpoint);
      });
}
