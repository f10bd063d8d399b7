#pragma once

// A link's conditions as YAML keys: an agent's `link:` in a session file, and the emulator's
// options. What is out of its range is refused by file, line and key.

#include "link_emulator/link_conditions.h"
#include "options/yaml_options.h"

namespace pangea {

inline void Bind(YamlOptions& yaml, LinkConditions& conditions) {
  constexpr double kMaxDelay_ms = 60'000;
  constexpr double kMaxTime_s = 1e6;
  yaml.AddBetween("loss", 0, 1, &conditions.loss);
  yaml.AddBetween("delay_ms", 0, kMaxDelay_ms, &conditions.delay_ms);
  yaml.AddBetween("jitter_ms", 0, kMaxDelay_ms, &conditions.jitter_ms);
  yaml.AddBetween("reorder", 0, 1, &conditions.reorder);
  yaml.AddBetween("duplicate", 0, 1, &conditions.duplicate);
  yaml.AddList("partitions", &conditions.partitions,
               [](YamlOptions& item, LinkPartition& partition) {
                 item.AddBetween("at", 0, kMaxTime_s, &partition.at_s);
                 item.Require("at");
                 item.AddBetween("seconds", 0, kMaxTime_s, &partition.seconds);
                 item.Require("seconds");
               });
  yaml.Add("seed", &conditions.seed);
}

}  // namespace pangea
