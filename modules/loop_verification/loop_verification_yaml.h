#pragma once

// The alignment's options as YAML keys.

#include "loop_verification/drift_gate.h"
#include "options/yaml_options.h"

namespace pangea {

void Bind(YamlOptions& yaml, LoopVerificationOptions& options);
void Bind(YamlOptions& yaml, DriftGateOptions& options);

}  // namespace pangea
