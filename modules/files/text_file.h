#pragma once

// Reading and writing of files that a person named. Errors have the path and the cause.

#include <fstream>
#include <string>

namespace pangea {

// Opens a file for reading. It must be a regular file, or a link to one, because a FIFO makes its
// reader wait for ever, and a device may have no end. Throws std::runtime_error with path and
// cause.
std::ifstream OpenFile(const std::string& path);
// The whole text of a file. Throws as OpenFile.
std::string ReadTextFile(const std::string& path);
// Whether the path exists. A link that leads nowhere, or in a circle, does not.
bool Exists(const std::string& path);

// Replaces the contents of the file. Throws std::runtime_error when not all of it can be written.
void WriteTextFile(const std::string& path, const std::string& text);

}  // namespace pangea
