#pragma once

// A link's conditions as YAML keys: an agent's `link:` in a session file, and the emulator's
// options.

#include "link_emulator/link_conditions.h"
#include "options/yaml_options.h"

namespace pangea {

inline void Bind(YamlOptions& yaml, LinkConditions& conditions) {
  yaml.Add("loss", &conditions.loss);
  yaml.Add("delay_ms", &conditions.delay_ms);
  yaml.Add("jitter_ms", &conditions.jitter_ms);
  yaml.Add("reorder", &conditions.reorder);
  yaml.Add("duplicate", &conditions.duplicate);
  yaml.AddList("partitions", &conditions.partitions,
               [](YamlOptions& item, LinkPartition& partition) {
                 item.Add("at", &partition.at_s);
                 item.Require("at");
                 item.Add("seconds", &partition.seconds);
                 item.Require("seconds");
               });
  yaml.Add("seed", &conditions.seed);
}

}  // namespace pangea
