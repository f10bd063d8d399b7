#pragma once

// Repairs a damaged journal, so that every LCM tool can read it to its end.

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "log_file/damaged_copy.h"

namespace pangea {

// A part of the file from which no event can be read.
struct DamagedPart {
  FileRange range;
  bool torn = false;                    // an event that a crash interrupted
  int64_t event_number = 0, utime = 0;  // for the DAMAGED event that replaces it
};

// The repairs that were made. All zero: none.
struct JournalMend {
  int64_t damaged_bytes = 0;
  int damaged_parts = 0;
  int64_t torn_bytes = 0;
  std::string copy;  // the file with the copy of the damaged parts

  // Describes the repairs for people; empty if there were none.
  std::string Said(const std::string& journal) const;
};

// First copies all parts to a file beside the journal, then repairs it: parts at its end are cut
// off, the others become DAMAGED events. A part with fewer bytes than an event needs (which damage
// in place never leaves) becomes zeros: they are not repaired again, but LCM's own reader stops
// there. `file_bytes`: the file's length, updated to its new one. `before_mend` is called before
// damage is repaired, but not for a torn end. Throws std::runtime_error.
JournalMend MendJournal(const std::string& path, int fd, std::vector<DamagedPart> parts,
                        int64_t* file_bytes, const std::function<void()>& before_mend);

}  // namespace pangea
