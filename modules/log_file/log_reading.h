#pragma once

// The result of reading a log: what could not be read, and where.

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace pangea {

// A range of the file without a whole event, or with an event that its checksum contradicts.
struct LostPlace {
  struct Event {
    int64_t number = 0;  // the event number in the log
    double seconds = 0;  // from the capture of the log's first event to that of this one
  };
  int64_t offset = 0;  // in the file
  int64_t bytes = 0;
  std::optional<Event> before, after;  // the next whole events; none at the ends of the log

  int64_t end() const { return offset + bytes; }
};

struct LogReading {
  static constexpr size_t kMaxListed = 4;
  int64_t events = 0;             // without CHECKSUMS and DAMAGED, which are not messages
  int64_t checksums = 0;          // number of CHECKSUMS events
  int64_t lost_places = 0;        // before the end of the log
  int64_t lost_bytes = 0;         // in the lost places
  int64_t marked = 0;             // DAMAGED events: losses that the log's writer already found
  int64_t torn_bytes = 0;         // of a last event that is not complete
  std::vector<LostPlace> listed;  // the first kMaxListed lost places

  bool whole() const { return lost_places == 0 && torn_bytes == 0; }
};
// By the log's path. Logs without losses are in it too.
using LogReadings = std::map<std::string, LogReading>;

// One line for people: "2 damaged places, 8300 bytes lost: ...". Empty if nothing is lost.
std::string DescribeLoss(const LogReading& reading);
// "LOG: 2 damaged places, ...", one line for each log with losses.
std::vector<std::string> LossLines(const LogReadings& readings);

// Exit code of a program that did its work, but with a log that has losses.
inline constexpr int kExitLost = 3;
// Prints LossLines to stderr. Returns kExitLost if something was lost and `exit_code` is not 1 (the
// program failed); else `exit_code`.
int TellLosses(const std::string& program, const LogReadings& readings, int exit_code);

}  // namespace pangea
