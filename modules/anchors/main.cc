#include <memory>

#include "anchors/anchors_process.h"
#include "bus/process_main.h"

// KEYFRAME_*, MAP_STATE, CORRECTION_*, ANCHOR_EDIT --> AnchorsProcess --> ANCHOR_k, ANCHOR
int main(int argc, char** argv) {
  pangea::AnchorsOptions options;
  pangea::YamlOptions yaml;
  options.Visit(yaml);
  return pangea::ProcessMain(
      argc, argv,
      {"pangea-anchors", "Holds anchors in the maps, and tells agents where they are", yaml},
      [&](pangea::Bus& bus) { return std::make_unique<pangea::AnchorsProcess>(bus, options); });
}
