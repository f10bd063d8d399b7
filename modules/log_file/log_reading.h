#pragma once

// How the reading of a log went: what could not be read of it, and where.

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace pangea {

// A stretch of the file that holds no whole event, or one that its checksum contradicts.
struct LostPlace {
  struct Event {
    int64_t number = 0;  // as the log counts
    double seconds = 0;  // of its capture, since the log's first event
  };
  int64_t offset = 0;  // in the file
  int64_t bytes = 0;
  std::optional<Event> before, after;  // the whole events beside it; none at the log's ends

  int64_t end() const { return offset + bytes; }
};

struct LogReading {
  static constexpr size_t kMaxListed = 4;
  int64_t events = 0;             // without CHECKSUMS and DAMAGED, which are of the file itself
  int64_t checksums = 0;          // CHECKSUMS events
  int64_t lost_places = 0;        // in the middle
  int64_t lost_bytes = 0;         // there
  int64_t marked = 0;             // of the places: found before, by who wrote the log (DAMAGED)
  int64_t torn_bytes = 0;         // of an event in whose middle the log ends
  std::vector<LostPlace> listed;  // the first places

  bool whole() const { return lost_places == 0 && torn_bytes == 0; }
};
// By the log's path, whole ones too.
using LogReadings = std::map<std::string, LogReading>;

// For people, one line: "2 damaged places, 8300 bytes lost: ...". Empty if it is whole.
std::string DescribeLoss(const LogReading& reading);
// "LOG: 2 damaged places, ...", one line for each log that is not whole.
std::vector<std::string> LossLines(const LogReadings& readings);

// Exit code of a program that did what it was asked to, but of a log that is not whole.
inline constexpr int kExitLost = 3;
// Prints the lines to stderr. Returns `exit_code`; if something was lost and it does not say that
// the program failed (1), kExitLost.
int TellLosses(const std::string& program, const LogReadings& readings, int exit_code);

}  // namespace pangea
