#include "files/text_file.h"

#include <fmt/format.h>

#include <cerrno>
#include <filesystem>
#include <iterator>
#include <stdexcept>
#include <system_error>

namespace pangea {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void Fail(const std::string& path, const std::string& why) {
  throw std::runtime_error(fmt::format("{}: cannot be opened: {}", path, why));
}

std::string NameOf(fs::file_type type) {
  switch (type) {
    case fs::file_type::directory:
      return "a folder";
    case fs::file_type::fifo:
      return "a FIFO";
    case fs::file_type::socket:
      return "a socket";
    default:
      return "a device";
  }
}

}  // namespace

// The type is checked before opening: opening a FIFO already waits, and opening a device may act.
std::ifstream OpenFile(const std::string& path) {
  std::error_code error;
  const fs::file_type type = fs::status(path, error).type();
  if (error) {
    Fail(path, error.message());
  }
  if (type != fs::file_type::regular) {
    Fail(path, fmt::format("it is {}; only regular files are read", NameOf(type)));
  }
  std::ifstream file(path, std::ios::binary);
  if (!file) {
    Fail(path, std::generic_category().message(errno));
  }
  return file;
}

std::string ReadTextFile(const std::string& path) {
  std::ifstream file = OpenFile(path);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

bool Exists(const std::string& path) {
  std::error_code error;
  return fs::exists(path, error);
}

void WriteTextFile(const std::string& path, const std::string& text) {
  errno = 0;
  std::ofstream file(path, std::ios::binary);
  file << text;
  file.close();
  if (!file) {
    throw std::runtime_error(
        fmt::format("{}: cannot be written: {}", path, std::generic_category().message(errno)));
  }
}

}  // namespace pangea
