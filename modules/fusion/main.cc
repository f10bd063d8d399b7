#include "common/alignment/alignment_yaml.h"
#include "common/bus/process.h"
#include "fusion/fusion_process.h"

// KEYFRAME_*, PLACE_MATCH --> FusionProcess --> CONSTRAINT
int main(int argc, char** argv) {
  using pangea::FusionOptions;
  const auto bind = [](pangea::YamlOptions& yaml, FusionOptions& options) {
    pangea::Bind(yaml.Section("alignment"), options.alignment);
    pangea::Bind(yaml.Section("drift"), options.drift);
  };
  FusionOptions options;
  pangea::YamlOptions yaml;
  bind(yaml, options);
  const pangea::ProcessDescription description{
      "pangea-fusion", "Aligns maps: a verdict for every place match between two maps",
      yaml.Print()};
  return pangea::ProcessMain(argc, argv, description,
                             [&](pangea::Bus& bus, const std::string& options_file) {
                               if (!options_file.empty()) {
                                 yaml.ReadFile(options_file);
                               }
                               return std::make_unique<pangea::FusionProcess>(bus, options);
                             });
}
