#include "loop_verification/loop_verification_yaml.h"

namespace pangea {

void Bind(YamlOptions& yaml, LoopVerificationOptions& options) {
  YamlOptions& window = yaml.Section("window");
  window.Add("num_keyframes", &options.window.num_keyframes);
  window.Add("max_relative_depth_sigma", &options.window.max_relative_depth_sigma);
  YamlOptions& pnp = yaml.Section("pnp");
  pnp.Add("iterations", &options.pnp.iterations);
  pnp.Add("max_chi2", &options.pnp.max_chi2);
  YamlOptions& search = yaml.Section("search");
  search.Add("pixel_sigma", &options.search.pixel_sigma);
  search.Add("max_hamming", &options.search.max_hamming);
  search.Add("max_ratio", &options.search.max_ratio);
  search.Add("max_chi2", &options.search.max_chi2);
  search.Add("min_radius_px", &options.search.min_radius_px);
  search.Add("max_radius_px", &options.search.max_radius_px);
  search.Add("max_depth_m", &options.search.max_depth_m);
  search.Add("max_view_angle", &options.search.max_view_angle);
  search.Add("max_scale", &options.search.max_scale);
  YamlOptions& ba = yaml.Section("ba");
  ba.Add("pixel_sigma", &options.ba.pixel_sigma);
  ba.Add("systematic_px", &options.ba.systematic_px);
  ba.Add("scale_sigma", &options.ba.scale_sigma);
  ba.Add("max_chi2", &options.ba.max_chi2);
  ba.Add("max_depth_chi2", &options.ba.max_depth_chi2);
  ba.Add("sure_hamming", &options.ba.sure_hamming);
  ba.Add("iterations", &options.ba.iterations);
  yaml.Add("first_max_hamming", &options.first_max_hamming);
  yaml.Add("first_max_ratio", &options.first_max_ratio);
  yaml.Add("min_pnp_inliers", &options.min_pnp_inliers);
  yaml.Add("max_view_angle", &options.max_view_angle);
  yaml.Add("max_distance_m", &options.max_distance_m);
  yaml.Add("guess_tilt_floor", &options.guess_tilt_floor);
  yaml.Add("gravity_floor", &options.gravity_floor);
  yaml.Add("max_tilt_chi2", &options.max_tilt_chi2);
  yaml.Add("max_tilt", &options.max_tilt);
  yaml.Add("min_found", &options.min_found);
  yaml.Add("min_comparable", &options.min_comparable);
  yaml.Add("min_found_share", &options.min_found_share);
  yaml.Add("min_first_supported_share", &options.min_first_supported_share);
  yaml.Add("min_supported_share", &options.min_supported_share);
  yaml.Add("visibility_keyframes", &options.visibility_keyframes);
  yaml.Add("visibility_stride", &options.visibility_stride);
  yaml.Add("min_inliers", &options.min_inliers);
  yaml.Add("min_inlier_ratio", &options.min_inlier_ratio);
  yaml.Add("min_occupied_cells", &options.min_occupied_cells);
  yaml.Add("max_sigma_m", &options.max_sigma_m);
  yaml.Add("max_sigma_rad", &options.max_sigma_rad);
  yaml.Add("max_halves_chi2", &options.max_halves_chi2);
}

void Bind(YamlOptions& yaml, DriftGateOptions& options) {
  yaml.Add("max_drift_m", &options.max_drift_m);
  yaml.Add("max_drift_share", &options.max_drift_share);
  yaml.Add("max_yaw", &options.max_yaw);
  yaml.Add("max_yaw_per_m", &options.max_yaw_per_m);
}

}  // namespace pangea
