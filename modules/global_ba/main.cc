#include <memory>

#include "bus/process_main.h"
#include "global_ba/global_ba_process.h"

// KEYFRAME_*, PLACE_MATCH, CONSTRAINT, MAP_STATE --> GlobalBaProcess --> REFINEMENT
int main(int argc, char** argv) {
  pangea::GlobalBaOptions options;
  pangea::ScratchFileOptions scratch;
  pangea::CheckpointPlace checkpoint;
  pangea::YamlOptions yaml;
  options.Visit(yaml);
  return pangea::ProcessMain(
      argc, argv,
      {"pangea-global-ba",
       "Adjusts all keyframes and landmarks of a group at once while it is quiet", yaml, &scratch,
       &checkpoint},
      [&](pangea::Bus& bus) {
        return std::make_unique<pangea::GlobalBaProcess>(
            bus, options, std::make_shared<pangea::ScratchFile>(scratch), checkpoint);
      });
}
