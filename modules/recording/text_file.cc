#include "recording/text_file.h"

#include <fmt/format.h>

#include <fstream>
#include <stdexcept>

namespace pangea {

void WriteTextFile(const std::string& path, const std::string& text) {
  std::ofstream file(path, std::ios::binary);
  file << text;
  file.close();
  if (!file) {
    throw std::runtime_error(fmt::format("{}: cannot be written", path));
  }
}

}  // namespace pangea
