#pragma once

// What a journal says, event by event: what is a repeat, and whether two journals say the same.

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "log_file/log_reader.h"

namespace pangea::site {

// Two events of one name say the same of the same thing: of a keyframe, match, verification result
// or anchor edit the first counts, of a process' options the newest. Empty for what this version
// does not know: then each event counts.
std::string NameOf(const LogEvent& event);

struct JournalContents {
  // Checksum of the data of the event that counts, by its name.
  std::map<std::string, uint32_t> named;
  std::vector<uint32_t> others;  // checksums, in order
  int64_t events = 0;            // all of them
  LogReading reading;

  // The next event.
  void Take(const LogEvent& event);
  bool SaysTheSame(const JournalContents& other) const {
    return named == other.named && others == other.others;
  }
};

// Of what can be read. Tells its progress. A journal that is not there yet is empty. Throws
// std::runtime_error when it is none.
JournalContents ReadContents(const std::filesystem::path& journal);

// Picks the events that count, each once, from a second reading of the same journal.
class CountingEvents {
 public:
  explicit CountingEvents(const JournalContents& contents) : left_(contents.named) {}
  // Call it for each event in order.
  bool Counts(const LogEvent& event);

 private:
  std::map<std::string, uint32_t> left_;
};

}  // namespace pangea::site
