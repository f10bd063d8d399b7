#include "link_emulator/link_conditions.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace pangea {
namespace {

constexpr double kMaxDelay_ms = 60'000;

// Also false for NaN.
bool Within(double value, double low, double high) { return value >= low && value <= high; }

}  // namespace

std::optional<std::string> LinkConditions::Invalid() const {
  for (const auto& [name, share] : {std::pair{"loss", loss}, std::pair{"reorder", reorder},
                                    std::pair{"duplicate", duplicate}}) {
    if (!Within(share, 0, 1)) {
      return fmt::format("{} {} must be a share from 0 to 1", name, share);
    }
  }
  for (const auto& [name, delay] :
       {std::pair{"delay_ms", delay_ms}, std::pair{"jitter_ms", jitter_ms}}) {
    if (!Within(delay, 0, kMaxDelay_ms)) {
      return fmt::format("{} {} must be from 0 to {} ms", name, delay, kMaxDelay_ms);
    }
  }
  const bool partitions_good = std::ranges::all_of(partitions, [](const LinkPartition& partition) {
    return Within(partition.at_s, 0, 1e6) && Within(partition.seconds, 0, 1e6);
  });
  if (!partitions_good) {
    return "a partition's at and seconds must not be negative";
  }
  return std::nullopt;
}

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
