#pragma once

// The alignment's options as YAML keys.

#include "common/alignment/drift_gate.h"
#include "common/yaml_options.h"

namespace pangea {

void Bind(YamlOptions& yaml, AlignmentOptions& options);
void Bind(YamlOptions& yaml, DriftGateOptions& options);

}  // namespace pangea
