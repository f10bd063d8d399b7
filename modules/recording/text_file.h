#pragma once

#include <string>

namespace pangea {

// Replaces what the file holds. Throws std::runtime_error when it cannot be written to its end.
void WriteTextFile(const std::string& path, const std::string& text);

}  // namespace pangea
