#pragma once

// The contents of a journal, to find repeats and to test whether two journals are equivalent.

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "log_file/log_reader.h"

namespace pangea::site {

// A name for the subject of an event. Of several events with the same name, only one counts: the
// first for a keyframe, match, verification result or anchor edit; the newest for a process'
// options. Empty for events that this version does not know; each of them counts.
std::string NameOf(const LogEvent& event);

struct JournalContents {
  // Checksum of the data of the event that counts, by name.
  std::map<std::string, uint32_t> named;
  std::vector<uint32_t> others;  // checksums of events without name, in order
  int64_t events = 0;            // all of them
  LogReading reading;

  // Adds the next event.
  void Take(const LogEvent& event);
  bool SaysTheSame(const JournalContents& other) const {
    return named == other.named && others == other.others;
  }
};

// Reads the undamaged parts of a journal, and prints the progress. A missing journal is empty.
// Throws std::runtime_error if the file is not a journal.
JournalContents ReadContents(const std::filesystem::path& journal);

// Selects the events that count, each once, in a second reading of the same journal.
class CountingEvents {
 public:
  explicit CountingEvents(const JournalContents& contents) : left_(contents.named) {}
  // Call it for each event in order.
  bool Counts(const LogEvent& event);

 private:
  std::map<std::string, uint32_t> left_;
};

}  // namespace pangea::site
