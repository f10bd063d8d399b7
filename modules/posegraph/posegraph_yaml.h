#pragma once

// The pose graph's options as YAML keys.

#include "options/yaml_options.h"
#include "posegraph/posegraph.h"

namespace pangea {

inline void Bind(YamlOptions& yaml, PoseGraphOptions& options) {
  using Scope = PoseGraphOptions::Scope;
  yaml.AddChoice("scope", &options.scope, {{"all", Scope::kAll}, {"paper", Scope::kPaper}});
  yaml.Add("keyframes_per_waiting_loop", &options.keyframes_per_waiting_loop);
  yaml.Add("max_keyframes_waiting", &options.max_keyframes_waiting);
  yaml.Add("state_every", &options.state_every);
  YamlOptions& merge = yaml.Section("merge");
  merge.Add("min_viewpoints", &options.merge.min_viewpoints);
  merge.Add("min_strong_viewpoints", &options.merge.min_strong_viewpoints);
  merge.Add("strong_inliers", &options.merge.strong_inliers);
  merge.Add("viewpoint_distance_m", &options.merge.viewpoint_distance_m);
  merge.Add("viewpoint_angle", &options.merge.viewpoint_angle);
  merge.Add("min_scene_extent_m", &options.merge.min_scene_extent_m);
  merge.Add("min_viewpoints_at_one_spot", &options.merge.min_viewpoints_at_one_spot);
  merge.Add("max_rival_share_at_one_spot", &options.merge.max_rival_share_at_one_spot);
  merge.Add("max_rival_share", &options.merge.max_rival_share);
  merge.Add("agree_chi2", &options.merge.agree_chi2);
  merge.Add("min_drift_per_m", &options.merge.min_drift_per_m);
  merge.Add("min_yaw_drift_per_m", &options.merge.min_yaw_drift_per_m);
  YamlOptions& solver = yaml.Section("solver");
  solver.Add("loop_chi2", &options.solver.loop_chi2);
  solver.Add("gnc_factor", &options.solver.gnc_factor);
  solver.Add("gnc_steps", &options.solver.gnc_steps);
  solver.Add("max_iterations", &options.solver.max_iterations);
}

}  // namespace pangea
