#include "log_file/log_reading.h"

#include <fmt/format.h>

#include <iostream>

namespace pangea {
namespace {

std::string Between(const LostPlace& place) {
  if (place.before && place.after) {
    return fmt::format("between events {} and {}, {:.3f} to {:.3f} s", place.before->number,
                       place.after->number, place.before->seconds, place.after->seconds);
  }
  if (place.before) {
    return fmt::format("behind event {}, {:.3f} s", place.before->number, place.before->seconds);
  }
  return place.after ? fmt::format("before event {}", place.after->number) : "all there is";
}

std::string DescribeDamage(const LogReading& reading) {
  std::string text = fmt::format("{} damaged place{}, {} bytes lost", reading.lost_places,
                                 reading.lost_places == 1 ? "" : "s", reading.lost_bytes);
  if (reading.marked > 0) {
    text += fmt::format(" ({} found when the log was written, and kept beside it)", reading.marked);
  }
  const char* separator = ": ";
  for (const LostPlace& place : reading.listed) {
    text +=
        fmt::format("{}{} at byte {} ({})", separator, place.bytes, place.offset, Between(place));
    separator = "; ";
  }
  const auto others = reading.lost_places - static_cast<int64_t>(reading.listed.size());
  return others > 0 ? fmt::format("{}; and {} more", text, others) : text;
}

}  // namespace

std::string DescribeLoss(const LogReading& reading) {
  std::string text = reading.lost_places > 0 ? DescribeDamage(reading) : "";
  if (reading.torn_bytes > 0) {
    text += fmt::format(
        "{}ends in the middle of an event, its last {} bytes are lost: so does a capture that was "
        "killed, or still runs",
        text.empty() ? "" : "; ", reading.torn_bytes);
  }
  return text;
}

std::vector<std::string> LossLines(const LogReadings& readings) {
  std::vector<std::string> lines;
  for (const auto& [log, reading] : readings) {
    if (!reading.whole()) {
      lines.push_back(fmt::format("{}: {}", log, DescribeLoss(reading)));
    }
  }
  return lines;
}

int TellLosses(const std::string& program, const LogReadings& readings, int exit_code) {
  const std::vector<std::string> lines = LossLines(readings);
  for (const std::string& line : lines) {
    std::cerr << fmt::format("{}: {}\n", program, line);
  }
  constexpr int kFailed = 1;
  return lines.empty() || exit_code == kFailed ? exit_code : kExitLost;
}

}  // namespace pangea
