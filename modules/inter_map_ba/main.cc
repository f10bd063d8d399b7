#include <memory>

#include "bus/process_main.h"
#include "inter_map_ba/inter_map_ba_process.h"

// KEYFRAME_*, PLACE_MATCH --> InterMapBaProcess --> CONSTRAINT
int main(int argc, char** argv) {
  pangea::InterMapBaOptions options;
  pangea::ScratchFileOptions scratch;
  pangea::CheckpointPlace checkpoint;
  pangea::YamlOptions yaml;
  options.Visit(yaml);
  return pangea::ProcessMain(
      argc, argv,
      {"pangea-inter-map-ba",
       "Closes loops: a verification result for every place match within one map", yaml, &scratch,
       &checkpoint},
      [&](pangea::Bus& bus) {
        return std::make_unique<pangea::InterMapBaProcess>(
            bus, options, std::make_shared<pangea::ScratchFile>(scratch), checkpoint);
      });
}
