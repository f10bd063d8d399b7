#include <memory>

#include "common/bus/process.h"
#include "map_points/map_points_process.h"
#include "map_points/map_points_yaml.h"

// KEYFRAME_*, MAP_STATE, REFINEMENT, POSE_* --> MapPointsProcess --> LANDMARKS_k
int main(int argc, char** argv) {
  pangea::MapPointsOptions options;
  pangea::YamlOptions yaml;
  pangea::Bind(yaml, options);
  const pangea::ProcessDescription description{
      "pangea-map-points", "Sends each agent the landmarks of the fused map that it may see next",
      yaml.Print()};
  return pangea::ProcessMain(argc, argv, description,
                             [&](pangea::Bus& bus, const std::string& options_file) {
                               if (!options_file.empty()) {
                                 yaml.ReadFile(options_file);
                               }
                               return std::make_unique<pangea::MapPointsProcess>(bus, options);
                             });
}
