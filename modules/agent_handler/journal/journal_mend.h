#pragma once

// Makes a damaged journal a log again that every LCM tool reads to its end.

#include <cstdint>
#include <string>
#include <vector>

#include "log_file/damaged_copy.h"

namespace pangea {

// A part of the file that no event can be read from.
struct DamagedPart {
  FileRange range;
  bool torn = false;                    // by a crash
  int64_t event_number = 0, utime = 0;  // for what stands in its place
};

// What was done. All zero: there was nothing to do.
struct JournalMend {
  int64_t damaged_bytes = 0;
  int damaged_parts = 0;
  int64_t torn_bytes = 0;
  std::string copy;  // the file they are kept in

  // For people; empty if there was nothing to do.
  std::string Said(const std::string& journal) const;
};

// First keeps all the parts beside the journal, then mends it: parts that end it are cut off, the
// others become DAMAGED events. Of fewer bytes than an event needs (damage in place leaves none
// such) they become zeros, which need no mending, but where LCM's own reader stops. `file_bytes`:
// its length, and then its new one. Throws std::runtime_error.
JournalMend MendJournal(const std::string& path, int fd, std::vector<DamagedPart> parts,
                        int64_t* file_bytes);

}  // namespace pangea
