#pragma once

// Where damaged parts of a file are kept before the file is mended: beside it, under a name of
// their own.

#include <cstdint>
#include <string>
#include <vector>

namespace pangea {

struct FileRange {
  int64_t begin = 0;
  int64_t end = 0;  // the first byte behind it
};

// "journal.lcm.damaged-20261123T055342Z", with "-2" and so on behind it where that exists.
std::string DamagedName(const std::string& file);

// Writes these parts of the open file `fd`, one behind the other, to a new file of that name, which
// is on the disk when this returns; its name. Throws std::runtime_error if it cannot be; then no
// part of it is left.
std::string KeepDamaged(const std::string& file, int fd, const std::vector<FileRange>& parts);

}  // namespace pangea
