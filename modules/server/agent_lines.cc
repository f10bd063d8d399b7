#include "server/agent_lines.h"

#include <fstream>
#include <string_view>
#include <system_error>
#include <utility>

namespace pangea {
namespace {

constexpr std::string_view kProcess = "agent_handler: ";
constexpr std::string_view kAgent = "agent ";

std::uintmax_t SizeOf(const std::filesystem::path& file) {
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(file, error);
  return error ? 0 : size;
}

}  // namespace

AgentLines::AgentLines(std::filesystem::path log) : log_(std::move(log)), read_(SizeOf(log_)) {}

std::vector<std::string> AgentLines::Take() {
  std::vector<std::string> lines;
  const std::uintmax_t size = SizeOf(log_);
  if (size < read_) {  // somebody has emptied it
    read_ = 0;
  }
  if (size == read_) {
    return lines;
  }
  std::ifstream file(log_);
  file.seekg(static_cast<std::streamoff>(read_));
  for (std::string line; std::getline(file, line) && !file.eof();) {  // at the end: half a line
    read_ += line.size() + 1;
    if (line.starts_with(kProcess) &&
        std::string_view(line).substr(kProcess.size()).starts_with(kAgent)) {
      lines.push_back(line.substr(kProcess.size()));
    }
  }
  return lines;
}

}  // namespace pangea
