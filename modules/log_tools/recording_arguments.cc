#include "log_tools/recording_arguments.h"

#include <fmt/format.h>

#include <charconv>
#include <filesystem>
#include <stdexcept>

namespace pangea::session {

std::map<int32_t, std::string> RecordingsById(const std::vector<std::string>& arguments) {
  std::map<int32_t, std::string> folders;
  for (const std::string& argument : arguments) {
    const char* const end = argument.data() + argument.size();
    int32_t id = 0;
    const auto [equals, error] = std::from_chars(argument.data(), end, id);
    if (error != std::errc() || equals == end || *equals != '=' || id < 1) {
      throw std::runtime_error(fmt::format(
          "--recording {}: give it as ID=FOLDER, for example 1=recordings/MH_01", argument));
    }
    folders[id] = std::string(equals + 1, end);
    if (!std::filesystem::is_directory(folders[id])) {
      throw std::runtime_error(fmt::format("--recording {}: there is no such folder", argument));
    }
  }
  return folders;
}

}  // namespace pangea::session
