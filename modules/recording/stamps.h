#pragma once

// Names what the time stamps of a sensor show: gaps, stamps in pairs or bursts, and another rate
// than sensor.yaml has.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace pangea {

// Appends warnings about the stamps of file `csv`. `utimes`: ascending, microseconds. A gap is
// `gap_factor` times as long as the usual period. `stated_hz`: the rate in `sensor_yaml`.
void NameStamps(const std::vector<int64_t>& utimes, double gap_factor, const std::string& csv,
                const std::optional<double>& stated_hz, const std::string& sensor_yaml,
                std::vector<std::string>* warnings);

}  // namespace pangea
