#pragma once

// The options of map_points as YAML keys.

#include "map_points/map_points.h"
#include "options/yaml_options.h"

namespace pangea {

inline void Bind(YamlOptions& yaml, MapPointsOptions& options) {
  yaml.Add("max_landmarks", &options.max_landmarks);
  yaml.Add("max_sources", &options.max_sources);
  yaml.Add("ahead_s", &options.ahead_s);
  yaml.Add("max_distance_m", &options.max_distance_m);
  yaml.Add("max_angle_rad", &options.max_angle_rad);
  yaml.Add("max_scale", &options.max_scale);
  yaml.Add("own_recent", &options.own_recent);
  yaml.Add("repeat_after", &options.repeat_after);
  yaml.Add("moved_m", &options.moved_m);
  YamlOptions& track = yaml.Section("track");
  track.Add("sigma_px", &options.track.sigma_px);
  track.Add("min_rays", &options.track.min_rays);
  track.Add("max_relative_sigma", &options.track.max_relative_sigma);
}

}  // namespace pangea
