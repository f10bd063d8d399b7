#include "link_emulator/link_conditions.h"

#include <fmt/format.h>

#include <utility>

namespace pangea {

std::string Describe(const LinkConditions& conditions) {
  std::string text;
  const auto add = [&text](const std::string& part) { text += (text.empty() ? "" : ", ") + part; };
  for (const auto& [name, share] :
       {std::pair{"loss", conditions.loss}, std::pair{"reorder", conditions.reorder},
        std::pair{"duplicate", conditions.duplicate}}) {
    if (share > 0) {
      add(fmt::format("{} {:g} %", name, 100 * share));
    }
  }
  for (const auto& [name, delay_ms] :
       {std::pair{"delay", conditions.delay_ms}, std::pair{"jitter", conditions.jitter_ms}}) {
    if (delay_ms > 0) {
      add(fmt::format("{} {:g} ms", name, delay_ms));
    }
  }
  for (const LinkPartition& partition : conditions.partitions) {
    add(fmt::format("cut at {:g} s for {:g} s", partition.at_s, partition.seconds));
  }
  return text.empty() ? "perfect" : text;
}

}  // namespace pangea
