#include "log_tools/recording_arguments.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <charconv>
#include <filesystem>
#include <stdexcept>

#include "log_tools/log_info.h"

namespace pangea {

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

std::map<int32_t, std::string> RecordingsOf(const std::vector<std::string>& arguments,
                                            const std::vector<std::string>& logs,
                                            LogReadings* readings) {
  std::map<int32_t, std::string> folders = RecordingsById(arguments);
  const std::set<int32_t> agents = folders.empty() ? std::set<int32_t>() : AgentsIn(logs, readings);
  for (const auto& [id, folder] : folders) {
    if (!agents.contains(id)) {
      throw std::runtime_error(
          fmt::format("--recording {}={}: nothing of agent {} in {}; there are agents {}", id,
                      folder, id, fmt::join(logs, ", "), fmt::join(agents, ", ")));
    }
  }
  return folders;
}

}  // namespace pangea
