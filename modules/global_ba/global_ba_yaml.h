#pragma once

// The global bundle adjustment's options as YAML keys.

#include "global_ba/global_ba.h"
#include "options/yaml_options.h"

namespace pangea {

inline void Bind(YamlOptions& yaml, GlobalBaOptions& options) {
  yaml.Add("min_keyframes", &options.min_keyframes);
  YamlOptions& landmarks = yaml.Section("landmarks");
  landmarks.Add("track_sigma_px", &options.world.landmarks.track_sigma_px);
  landmarks.Add("match_sigma_px", &options.world.landmarks.match_sigma_px);
  landmarks.Add("min_parallax", &options.world.landmarks.min_parallax);
  landmarks.Add("max_start_sigmas", &options.world.landmarks.max_start_sigmas);
  YamlOptions& redundancy = yaml.Section("redundancy");
  redundancy.Add("share", &options.world.redundancy.share);
  redundancy.Add("observers", &options.world.redundancy.observers);
  redundancy.Add("max_gap_s", &options.world.redundancy.max_gap_s);
  YamlOptions& ba = yaml.Section("ba");
  ba.Add("gyro_random_walk", &options.ba.imu.gyro_random_walk);
  ba.Add("accel_random_walk", &options.ba.imu.accel_random_walk);
  ba.Add("gyro_bias_sigma", &options.ba.gyro_bias_sigma);
  ba.Add("accel_bias_sigma", &options.ba.accel_bias_sigma);
  ba.Add("camera_position_sigma", &options.ba.camera_position_sigma);
  ba.Add("camera_rotation_sigma", &options.ba.camera_rotation_sigma);
  ba.Add("edge_weight", &options.ba.edge_weight);
  ba.Add("edge_scale_sigma", &options.ba.edge_scale_sigma);
  ba.Add("loss_scale", &options.ba.loss_scale);
  ba.Add("max_chi2", &options.ba.max_chi2);
  ba.Add("iterations_a_piece", &options.ba.iterations_a_piece);
  ba.Add("max_iterations", &options.ba.max_iterations);
  ba.Add("function_tolerance", &options.ba.function_tolerance);
}

}  // namespace pangea
