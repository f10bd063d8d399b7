#include "server_options/server_options.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <set>
#include <stdexcept>

#include "log_file/log_reader.h"
#include "messages/channels.h"
#include "messages/encoding.h"
#include "messages/messages.h"
#include "options/yaml_options.h"

namespace pangea {
namespace {

// Takes the message if its process is one of ServerOptions. Returns the unknown options. Throws if
// the text cannot be read; `options` is then unchanged.
std::vector<std::string> Take(const ProcessOptions& message, const std::string& log,
                              ServerOptions* options) {
  ServerOptions taken = *options;
  YamlOptions yaml;
  taken.Visit(yaml);
  YamlOptions* const section = yaml.FindSection(message.process);
  if (section == nullptr) {
    return {};
  }
  std::vector<std::string> unknown = section->ReadKnown(
      message.yaml, fmt::format("{}: {}", log, channels::Options(message.process)));
  *options = taken;
  return unknown;
}

std::map<std::string, ProcessOptions> NewestByProcess(const std::filesystem::path& log,
                                                      LogReadings* readings) {
  std::map<std::string, ProcessOptions> newest;
  const auto read = [&newest](const LogEvent& event) {
    options_t message{};
    if (!event.channel.starts_with(channels::kOptionsPrefix) ||
        !DecodeMessage(event.data, &message)) {
      return;
    }
    if (auto parsed = Parse(message); parsed.value) {
      newest[message.process] = *std::move(parsed.value);
    }
  };
  ReadLog(log.string(), read, readings);
  return newest;
}

// Notes for the processes whose options are not in the logs.
std::vector<std::string> NotTold(const std::set<std::string>& told) {
  ServerOptions options;
  YamlOptions yaml;
  options.Visit(yaml);
  std::vector<std::string> others = yaml.Keys();
  std::erase_if(others, [&told](const std::string& process) { return told.contains(process); });
  return others;
}

}  // namespace

LoggedOptions ReadLoggedOptions(const std::vector<std::filesystem::path>& logs,
                                LogReadings* readings) {
  LoggedOptions logged;
  std::set<std::string> told;
  for (const std::filesystem::path& log : logs) {
    for (const auto& [process, message] : NewestByProcess(log, readings)) {
      told.insert(process);
      try {
        if (const auto unknown = Take(message, log.string(), &logged.options); !unknown.empty()) {
          logged.notes.push_back(fmt::format(
              "options of {}: as in the log, but for what this version does not know: {}", process,
              fmt::join(unknown, ", ")));
        }
      } catch (const std::runtime_error& error) {
        logged.notes.push_back(fmt::format(
            "options of {}: defaults, as this version does not read those of the log: {}", process,
            error.what()));
      }
    }
  }
  if (const std::vector<std::string> others = NotTold(told); !others.empty()) {
    logged.notes.push_back(fmt::format("options of {}: defaults, as the log has none (OPTIONS_*)",
                                       fmt::join(others, ", ")));
  }
  return logged;
}

void Override(const std::string& file, const std::vector<std::string>& values,
              ServerOptions* options) {
  YamlOptions yaml;
  options->Visit(yaml);
  if (!file.empty()) {
    yaml.ReadFile(file);
  }
  for (const std::string& value : values) {
    const size_t equals = value.find('=');
    if (equals == std::string::npos) {
      throw std::runtime_error(fmt::format(
          "--set {}: must be process.key=value, as fusion.alignment.min_inliers=20", value));
    }
    yaml.Set(value.substr(0, equals), value.substr(equals + 1));
  }
}

std::map<std::string, std::string> TextsByProcess(ServerOptions options) {
  YamlOptions yaml;
  options.Visit(yaml);
  std::map<std::string, std::string> texts;
  for (const std::string& process : yaml.Keys()) {
    texts[process] = yaml.FindSection(process)->PrintWithoutHelp();
  }
  return texts;
}

std::vector<std::string> OtherThanDefault(ServerOptions options) {
  YamlOptions yaml, default_yaml;
  ServerOptions defaults;
  options.Visit(yaml);
  defaults.Visit(default_yaml);
  const std::map<std::string, std::string> default_values = default_yaml.Values();
  std::vector<std::string> others;
  for (const auto& [path, value] : yaml.Values()) {
    if (const std::string& usual = default_values.at(path); value != usual) {
      others.push_back(fmt::format("{} {} (default {})", path, value, usual));
    }
  }
  return others;
}

}  // namespace pangea
