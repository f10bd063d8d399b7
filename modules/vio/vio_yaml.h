#pragma once

// The odometry's options as a YAML file: `pangea-vio --print-options` shows it whole.

#include "core/imu/imu.h"
#include "options/yaml_options.h"
#include "vio/vio.h"

namespace pangea::vio {

struct VioFileOptions {
  VioOptions vio;
  ImuNoise live_imu;  // of a live sensor; a recording brings its own
};

// `options` must outlive `yaml`.
void Bind(YamlOptions& yaml, VioFileOptions& options);

}  // namespace pangea::vio
