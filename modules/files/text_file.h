#pragma once

// Files that somebody named. What cannot be read or written is said with its path and the cause.

#include <fstream>
#include <string>

namespace pangea {

// Opens a file to read. Only a regular one, or a link to one: a FIFO makes its reader wait for
// ever, and a device may have no end. Throws std::runtime_error naming the path and the cause.
std::ifstream OpenFile(const std::string& path);
// All that is in it; throws likewise.
std::string ReadTextFile(const std::string& path);
// Whether there is something of this name. A link that leads nowhere or round in circles is
// nothing.
bool Exists(const std::string& path);

// Replaces what the file holds. Throws std::runtime_error when it cannot be written to its end.
void WriteTextFile(const std::string& path, const std::string& text);

}  // namespace pangea
