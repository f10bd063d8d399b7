#include "vio/vio_yaml.h"

namespace pangea::vio {
namespace {

void BindTracker(YamlOptions& yaml, TrackerOptions& o) {
  yaml.Add("max_features", &o.max_features);
  yaml.Add("grid_columns", &o.grid_columns);
  yaml.Add("grid_rows", &o.grid_rows);
  yaml.Add("min_distance_px", &o.min_distance_px);
  yaml.Add("window_px", &o.window_px);
  yaml.Add("pyramid_levels", &o.pyramid_levels);
  yaml.Add("max_forward_backward_px", &o.max_forward_backward_px);
  yaml.Add("border_px", &o.border_px);
  yaml.Add("quality", &o.quality);
  yaml.Add("min_eigenvalue", &o.min_eigenvalue);
  yaml.Add("equalize", &o.equalize);
  yaml.Add("equalize_clip", &o.equalize_clip);
  yaml.Add("sigma_px", &o.sigma_px);
  YamlOptions& two_view = yaml.Section("two_view");
  two_view.Add("inlier_px", &o.two_view.inlier_px);
  two_view.Add("rotation_sigma", &o.two_view.rotation_sigma);
  two_view.Add("iterations", &o.two_view.iterations);
}

void BindDescriber(YamlOptions& yaml, DescriberOptions& o) {
  yaml.Add("max_corners", &o.max_corners);
  yaml.Add("octaves", &o.octaves);
  yaml.Add("scale_factor", &o.scale_factor);
  yaml.Add("fast_threshold", &o.fast_threshold);
  yaml.Add("fast_threshold_low", &o.fast_threshold_low);
  yaml.Add("cell_px", &o.cell_px);
}

void BindEstimator(YamlOptions& yaml, EstimatorOptions& o) {
  yaml.Add("window", &o.window);
  yaml.Add("window_parallax_px", &o.window_parallax_px);
  yaml.Add("window_track_share", &o.window_track_share);
  yaml.Add("pixel_sigma", &o.pixel_sigma);
  yaml.Add("keyframe_parallax_px", &o.keyframe_parallax_px);
  yaml.Add("keyframe_track_share", &o.keyframe_track_share);
  yaml.Add("keyframe_interval_s", &o.keyframe_interval_s);
  yaml.Add("keyframe_min_interval_s", &o.keyframe_min_interval_s);
}

void BindImu(YamlOptions& yaml, ImuNoise& o) {
  yaml.AddPositive("gyro_noise_density", &o.gyro_noise_density);
  yaml.AddPositive("gyro_random_walk", &o.gyro_random_walk);
  yaml.AddPositive("accel_noise_density", &o.accel_noise_density);
  yaml.AddPositive("accel_random_walk", &o.accel_random_walk);
  yaml.AddPositive("rate_hz", &o.rate_hz);
  yaml.AddNotNegative("gyro_scale_sigma", &o.gyro_scale_sigma);
  yaml.AddNotNegative("accel_scale_sigma", &o.accel_scale_sigma);
  yaml.AddNotNegative("axes_sigma", &o.axes_sigma);
}

}  // namespace

void Bind(YamlOptions& yaml, VioFileOptions& options) {
  BindTracker(yaml.Section("tracker"), options.vio.tracker);
  BindDescriber(yaml.Section("describer"), options.vio.describer);
  BindEstimator(yaml.Section("estimator"), options.vio.estimator);
  yaml.Add("max_points", &options.vio.max_points);
  BindImu(yaml.Section("live_imu"), options.live_imu);
}

}  // namespace pangea::vio
