#include <memory>

#include "common/bus/process.h"
#include "global_ba/global_ba_process.h"
#include "global_ba/global_ba_yaml.h"

// KEYFRAME_*, PLACE_MATCH, CONSTRAINT, MAP_STATE --> GlobalBaProcess --> REFINEMENT
int main(int argc, char** argv) {
  pangea::GlobalBaOptions options;
  pangea::YamlOptions yaml;
  pangea::Bind(yaml, options);
  const pangea::ProcessDescription description{
      "pangea-global-ba",
      "Adjusts all keyframes and landmarks of a group at once while it is quiet", yaml.Print()};
  return pangea::ProcessMain(argc, argv, description,
                             [&](pangea::Bus& bus, const std::string& options_file) {
                               if (!options_file.empty()) {
                                 yaml.ReadFile(options_file);
                               }
                               return std::make_unique<pangea::GlobalBaProcess>(bus, options);
                             });
}
