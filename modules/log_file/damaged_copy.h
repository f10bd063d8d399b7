#pragma once

// Copies the damaged parts of a file to a new file beside it, before the file is mended.

#include <cstdint>
#include <string>
#include <vector>

namespace pangea {

struct FileRange {
  int64_t begin = 0;
  int64_t end = 0;  // the first byte behind it
};

// The name for the copy, "journal.lcm.damaged-20261123T055342Z"; "-2" and so on follows if that
// name exists.
std::string DamagedName(const std::string& file);

// Writes these parts of the open file `fd`, one after the other, to a new file DamagedName(file).
// Returns its name when it is on the disk. Throws std::runtime_error if it cannot be written; then
// the new file is removed.
std::string KeepDamaged(const std::string& file, int fd, const std::vector<FileRange>& parts);

}  // namespace pangea
