#include "bus/process_main.h"
#include "inter_map_ba/inter_map_ba_process.h"

// KEYFRAME_*, PLACE_MATCH --> InterMapBaProcess --> CONSTRAINT
int main(int argc, char** argv) {
  pangea::InterMapBaOptions options;
  pangea::YamlOptions yaml;
  options.Visit(yaml);
  return pangea::ProcessMain(
      argc, argv,
      {"pangea-inter-map-ba",
       "Closes loops: a verification result for every place match within one map", yaml},
      [&](pangea::Bus& bus) { return std::make_unique<pangea::InterMapBaProcess>(bus, options); });
}
