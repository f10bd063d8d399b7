#include "session/session_file.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <set>
#include <stdexcept>

#include "common/yaml_options.h"
#include "link_emulator/link_conditions_yaml.h"

namespace pangea::session {
namespace {

namespace fs = std::filesystem;

// A recording is a folder with mav0 in it, or mav0 itself.
bool IsRecording(const fs::path& folder) {
  return fs::is_directory(folder / "mav0") || fs::is_directory(folder / "cam0");
}

// The folder itself, or the only folder whose name continues it (MH_01 -> MH_01_easy).
std::optional<fs::path> FindRecording(const fs::path& wanted) {
  if (IsRecording(wanted)) {
    return wanted;
  }
  std::optional<fs::path> found;
  const std::string prefix = wanted.filename().string() + "_";
  if (fs::is_directory(wanted.parent_path())) {
    for (const auto& entry : fs::directory_iterator(wanted.parent_path())) {
      if (entry.path().filename().string().starts_with(prefix) && IsRecording(entry.path())) {
        if (found) {
          return std::nullopt;
        }
        found = entry.path();
      }
    }
  }
  return found;
}

void CheckAgents(const SessionScript& script, const std::string& file) {
  if (script.agents.empty()) {
    throw std::runtime_error(fmt::format("{}: 'agents' is empty: list at least one agent", file));
  }
  std::set<int32_t> ids;
  for (const AgentScript& agent : script.agents) {
    if (agent.id < 1 || agent.id > 65535) {
      throw std::runtime_error(
          fmt::format("{}: agent id {}: use a number from 1 to 65535", file, agent.id));
    }
    if (!ids.insert(agent.id).second) {
      throw std::runtime_error(
          fmt::format("{}: agent id {} is given twice: every agent needs its own", file, agent.id));
    }
    if (agent.delay_s < 0 || agent.start_s < 0 || agent.duration_s < 0) {
      throw std::runtime_error(fmt::format(
          "{}: agent {}: delay, start and duration must not be negative", file, agent.id));
    }
    if (agent.recording.empty() && agent.keyframes.empty()) {
      throw std::runtime_error(
          fmt::format("{}: agent {}: give it a 'recording', or 'keyframes'", file, agent.id));
    }
    if (!agent.keyframes.empty() && agent.start_s > 0) {
      throw std::runtime_error(fmt::format(
          "{}: agent {}: stored keyframes are played from the first one on: leave out 'start'",
          file, agent.id));
    }
    if (!(agent.budget_kb_per_s == 0 ||
          (agent.budget_kb_per_s >= 5 && agent.budget_kb_per_s < 1e6))) {
      throw std::runtime_error(fmt::format(
          "{}: agent {}: budget_kb_per_s must be at least 5, or 0 for no bound", file, agent.id));
    }
    if (const auto invalid = agent.link ? agent.link->Invalid() : std::nullopt) {
      throw std::runtime_error(fmt::format("{}: agent {}: link: {}", file, agent.id, *invalid));
    }
  }
}

// What a session's processes are called.
std::set<std::string> ProcessNames(const SessionScript& script) {
  std::set<std::string> names(std::begin(kServerProcesses), std::end(kServerProcesses));
  names.insert("logger_server");
  for (const AgentScript& agent : script.agents) {
    names.insert(fmt::format("{}_{}", agent.keyframes.empty() ? "vio" : "keyframes", agent.id));
    names.insert(fmt::format("uplink_{}", agent.id));
    names.insert(fmt::format("logger_agent_{}", agent.id));
    if (agent.link) {
      names.insert(fmt::format("link_emulator_{}", agent.id));
    }
  }
  return names;
}

void CheckFaults(const SessionScript& script, const std::string& file) {
  const std::set<std::string> names = ProcessNames(script);
  for (const Fault& fault : script.faults) {
    if (fault.at_s < 0 || fault.seconds < 0) {
      throw std::runtime_error(
          fmt::format("{}: faults: 'at' and 'seconds' must not be negative", file));
    }
    if (fault.kill.empty() == fault.disk_full.empty()) {
      throw std::runtime_error(fmt::format(
          "{}: faults: at {} s: give either 'kill' or 'disk_full', a process", file, fault.at_s));
    }
    const std::string& process = fault.kill.empty() ? fault.disk_full : fault.kill;
    if (!names.contains(process)) {
      throw std::runtime_error(fmt::format("{}: faults: no process '{}' in this session: it has {}",
                                           file, process, fmt::join(names, ", ")));
    }
  }
}

void FindKeyframes(const fs::path& file, SessionScript* script) {
  for (AgentScript& agent : script->agents) {
    if (agent.keyframes.empty()) {
      continue;
    }
    agent.resolved_keyframes =
        (fs::absolute(file).parent_path() / agent.keyframes).lexically_normal();
    if (!fs::is_regular_file(agent.resolved_keyframes)) {
      throw std::runtime_error(
          fmt::format("{}: agent {}: no keyframe log at {}: pangea-vio --out-keyframes writes one",
                      file.string(), agent.id, agent.resolved_keyframes.string()));
    }
  }
}

}  // namespace

SessionScript ReadSessionFile(const fs::path& file, const std::optional<fs::path>& recordings) {
  SessionScript script;
  YamlOptions yaml;
  yaml.AddList("agents", &script.agents, [](YamlOptions& item, AgentScript& agent) {
    item.Add("id", &agent.id);
    item.Require("id");
    item.Add("recording", &agent.recording);
    item.Add("delay", &agent.delay_s);
    item.Add("start", &agent.start_s);
    item.Add("duration", &agent.duration_s);
    item.Add("keyframes", &agent.keyframes);
    item.Add("budget_kb_per_s", &agent.budget_kb_per_s);
    item.AddOptional("link", &agent.link,
                     [](YamlOptions& link, LinkConditions& conditions) { Bind(link, conditions); });
  });
  yaml.Require("agents");
  yaml.AddList("faults", &script.faults, [](YamlOptions& item, Fault& fault) {
    item.Add("at", &fault.at_s);
    item.Require("at");
    item.Add("kill", &fault.kill);
    item.Add("disk_full", &fault.disk_full);
    item.Add("seconds", &fault.seconds);
  });
  yaml.ReadFile(file.string());
  CheckAgents(script, file.string());
  CheckFaults(script, file.string());
  FindKeyframes(file, &script);

  const fs::path base = recordings.value_or(fs::absolute(file).parent_path());
  std::string missing;
  for (AgentScript& agent : script.agents) {
    if (agent.recording.empty()) {
      continue;
    }
    const auto found = FindRecording((base / agent.recording).lexically_normal());
    if (found) {
      agent.resolved = *found;
    } else {
      missing += fmt::format("\n  agent {}: {}", agent.id,
                             (base / agent.recording).lexically_normal().string());
    }
  }
  if (!missing.empty()) {
    throw std::runtime_error(
        fmt::format("{}: no EuRoC recording (a folder with mav0/cam0 and mav0/imu0) at:{}\n"
                    "Put them there, or name the folder that holds them with --recordings DIR.",
                    file.string(), missing));
  }
  return script;
}

}  // namespace pangea::session
