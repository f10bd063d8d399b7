#include "bus/process_main.h"
#include "fusion/fusion_process.h"
#include "loop_verification/loop_verification_yaml.h"

// KEYFRAME_*, PLACE_MATCH --> FusionProcess --> CONSTRAINT
int main(int argc, char** argv) {
  pangea::FusionOptions options;
  pangea::YamlOptions yaml;
  pangea::Bind(yaml.Section("alignment"), options.alignment);
  pangea::Bind(yaml.Section("drift"), options.drift);
  return pangea::ProcessMain(
      argc, argv,
      {"pangea-fusion", "Aligns maps: a verification result for every place match between two maps",
       &yaml},
      [&](pangea::Bus& bus) { return std::make_unique<pangea::FusionProcess>(bus, options); });
}
