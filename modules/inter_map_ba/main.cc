#include "common/alignment/alignment_yaml.h"
#include "common/bus/process.h"
#include "inter_map_ba/inter_map_ba_process.h"

// KEYFRAME_*, PLACE_MATCH --> InterMapBaProcess --> CONSTRAINT
int main(int argc, char** argv) {
  using pangea::InterMapBaOptions;
  const auto bind = [](pangea::YamlOptions& yaml, InterMapBaOptions& options) {
    pangea::Bind(yaml.Section("alignment"), options.alignment);
    pangea::Bind(yaml.Section("drift"), options.drift);
  };
  InterMapBaOptions options;
  pangea::YamlOptions yaml;
  bind(yaml, options);
  const pangea::ProcessDescription description{
      "pangea-inter-map-ba", "Closes loops: a verdict for every place match within one map",
      yaml.Print()};
  return pangea::ProcessMain(argc, argv, description,
                             [&](pangea::Bus& bus, const std::string& options_file) {
                               if (!options_file.empty()) {
                                 yaml.ReadFile(options_file);
                               }
                               return std::make_unique<pangea::InterMapBaProcess>(bus, options);
                             });
}
