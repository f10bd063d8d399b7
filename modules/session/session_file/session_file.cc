#include "session/session_file/session_file.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <set>
#include <stdexcept>

#include "core/anchor.h"
#include "core/text/control_characters.h"
#include "options/nearest_word.h"
#include "options/yaml_options.h"
#include "recording/euroc.h"
#include "server/server_processes.h"

namespace pangea::session {
namespace {

namespace fs = std::filesystem;

constexpr int32_t kMaxAgentId = 65535;
constexpr double kMaxTime_s = 1e6;  // eleven days
constexpr double kMaxPixel = 20000;

void CheckAgent(const AgentScript& agent, const std::string& file) {
  if (agent.recording.empty() && agent.keyframes.empty() && !agent.live) {
    throw std::runtime_error(fmt::format(
        "{}: agent {}: give it a 'recording', 'keyframes', or 'live: true'", file, agent.id));
  }
  if (agent.live && (!agent.keyframes.empty() || agent.start_s > 0)) {
    throw std::runtime_error(fmt::format("{}: agent {}: is live, nothing is played: leave out '{}'",
                                         file, agent.id,
                                         agent.keyframes.empty() ? "start" : "keyframes"));
  }
  if (const auto invalid = agent.uplink.Invalid()) {
    throw std::runtime_error(fmt::format("{}: agent {}: uplink: {}", file, agent.id, *invalid));
  }
  if (!agent.keyframes.empty() && agent.start_s > 0) {
    throw std::runtime_error(fmt::format(
        "{}: agent {}: stored keyframes are played from the first one on: leave out 'start'", file,
        agent.id));
  }
  if (!agent.keyframes.empty() && agent.vio_options) {
    throw std::runtime_error(fmt::format(
        "{}: agent {}: with stored keyframes no odometry is run: leave out 'vio'", file, agent.id));
  }
}

void CheckAgents(const SessionScript& script, const std::string& file) {
  if (script.agents.empty()) {
    throw std::runtime_error(fmt::format("{}: 'agents' is empty: list at least one agent", file));
  }
  if (script.agents.size() > kMaxSessionAgents) {
    throw std::runtime_error(fmt::format("{}: 'agents' lists {}: a session takes {} at most", file,
                                         script.agents.size(), kMaxSessionAgents));
  }
  std::set<int32_t> ids;
  for (const AgentScript& agent : script.agents) {
    if (!ids.insert(agent.id).second) {
      throw std::runtime_error(
          fmt::format("{}: agent id {} is given twice: every agent needs its own", file, agent.id));
    }
    CheckAgent(agent, file);
  }
}

// The names of a session's processes.
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

void CheckProcess(const std::set<std::string>& names, const std::string& process,
                  const std::string& file) {
  if (!names.contains(process)) {
    throw std::runtime_error(fmt::format("{}: faults: no process '{}' in this session{}", file,
                                         process,
                                         NearestWordHint(process, {names.begin(), names.end()})));
  }
}

void CheckFaults(const SessionScript& script, const std::string& file) {
  const std::set<std::string> names = ProcessNames(script);
  for (const Fault& fault : script.faults) {
    if (!fault.kill.empty() + !fault.disk_full.empty() + (fault.disconnect != 0) != 1) {
      throw std::runtime_error(fmt::format(
          "{}: faults: at {} s: give one of 'kill' or 'disk_full', a process, or 'disconnect', an "
          "agent's id",
          file, fault.at_s));
    }
    if (fault.disconnect == 0) {
      CheckProcess(names, fault.kill.empty() ? fault.disk_full : fault.kill, file);
    } else if (std::ranges::none_of(script.agents, [&fault](const AgentScript& agent) {
                 return agent.id == fault.disconnect;
               })) {
      throw std::runtime_error(
          fmt::format("{}: faults: at {} s: disconnect: there is no agent {} in this session", file,
                      fault.at_s, fault.disconnect));
    }
  }
}

void CheckAnchor(const AnchorScript& anchor, const SessionScript& script, const std::string& file) {
  if (anchor.name.empty() || HasControlCharacter(anchor.name)) {
    throw std::runtime_error(fmt::format(
        "{}: anchors: at {} s: 'name' must be a text of printable characters", file, anchor.at_s));
  }
  const auto agent = std::ranges::find(script.agents, anchor.agent, &AgentScript::id);
  if (agent == script.agents.end()) {
    throw std::runtime_error(fmt::format("{}: anchors: {}: there is no agent {} in this session",
                                         file, anchor.name, anchor.agent));
  }
  if (agent->recording.empty()) {
    throw std::runtime_error(
        fmt::format("{}: anchors: {}: agent {} has no 'recording', whose first image 'at' counts "
                    "from",
                    file, anchor.name, anchor.agent));
  }
}

void CheckAnchors(const SessionScript& script, const std::string& file) {
  if (script.anchors.size() > kMaxScriptedAnchors) {
    throw std::runtime_error(fmt::format("{}: 'anchors' lists {}: a session takes {} at most", file,
                                         script.anchors.size(), kMaxScriptedAnchors));
  }
  std::set<std::string> names;
  for (const AnchorScript& anchor : script.anchors) {
    CheckAnchor(anchor, script, file);
    if (!names.insert(anchor.name).second) {
      throw std::runtime_error(
          fmt::format("{}: anchors: the name '{}' is given twice: every anchor needs its own", file,
                      anchor.name));
    }
  }
}

void AddAnchors(YamlOptions& yaml, std::vector<AnchorScript>* anchors) {
  yaml.AddList("anchors", anchors, [](YamlOptions& item, AnchorScript& anchor) {
    item.AddBetween("agent", 1, kMaxAgentId, &anchor.agent);
    item.AddBetween("at", 0, kMaxTime_s, &anchor.at_s);
    item.AddText("name", kMaxAnchorName, &anchor.name);
    item.AddPairBetween("pixel", 0, kMaxPixel, &anchor.pixel.x(), &anchor.pixel.y());
    item.AddText("payload", kMaxAnchorPayload, &anchor.payload);
    for (const char* needed : {"agent", "at", "name", "pixel"}) {
      item.Require(needed);
    }
  });
}

}  // namespace

SessionScript ParseSessionFile(const fs::path& file) {
  SessionScript script;
  YamlOptions yaml;
  yaml.AddList("agents", &script.agents, [](YamlOptions& item, AgentScript& agent) {
    item.AddBetween("id", 1, kMaxAgentId, &agent.id);
    item.Require("id");
    item.Add("recording", &agent.recording);
    item.Add("live", &agent.live);
    item.AddBetween("delay", 0, kMaxTime_s, &agent.delay_s);
    item.AddBetween("start", 0, kMaxTime_s, &agent.start_s);
    item.AddBetween("duration", 0, kMaxTime_s, &agent.duration_s);
    item.Add("keyframes", &agent.keyframes);
    item.Section("uplink", &agent.uplink, "");
    item.AddOptional(
        "vio", &agent.vio_options,
        [](YamlOptions& section, vio::VioFileOptions& options) { options.Visit(section); });
    item.AddOptional("link", &agent.link,
                     [](YamlOptions& link, LinkConditions& conditions) { conditions.Visit(link); });
  });
  yaml.Require("agents");
  yaml.AddList("faults", &script.faults, [](YamlOptions& item, Fault& fault) {
    item.AddBetween("at", 0, kMaxTime_s, &fault.at_s);
    item.Require("at");
    item.Add("kill", &fault.kill);
    item.Add("disk_full", &fault.disk_full);
    item.AddBetween("disconnect", 1, kMaxAgentId, &fault.disconnect);
    item.AddBetween("seconds", 0, kMaxTime_s, &fault.seconds);
  });
  AddAnchors(yaml, &script.anchors);
  yaml.Section("options", &script.options, "");
  const ExpectationsSection expect(yaml, "expect");
  yaml.ReadFile(file.string());
  CheckAgents(script, file.string());
  CheckFaults(script, file.string());
  CheckAnchors(script, file.string());
  script.expect = expect.Take();
  return script;
}

std::vector<std::string> FindInputs(const fs::path& file, const std::optional<fs::path>& recordings,
                                    SessionScript* script) {
  const fs::path own_folder = fs::absolute(file).parent_path();
  std::vector<std::string> missing;
  for (AgentScript& agent : script->agents) {
    if (!agent.recording.empty()) {
      const fs::path wanted =
          (recordings.value_or(own_folder) / agent.recording).lexically_normal();
      if (const auto found = FindRecording(wanted)) {
        agent.resolved = *found;
      } else {
        missing.push_back(fmt::format("agent {}: recording {}", agent.id, wanted.string()));
      }
    }
    if (!agent.keyframes.empty()) {
      agent.resolved_keyframes = (own_folder / agent.keyframes).lexically_normal();
      if (!fs::is_regular_file(agent.resolved_keyframes)) {
        missing.push_back(
            fmt::format("agent {}: keyframes {}", agent.id, agent.resolved_keyframes.string()));
      }
    }
  }
  return missing;
}

SessionScript ReadSessionFile(const fs::path& file, const std::optional<fs::path>& recordings) {
  SessionScript script = ParseSessionFile(file);
  const std::vector<std::string> missing = FindInputs(file, recordings, &script);
  if (!missing.empty()) {
    throw std::runtime_error(fmt::format(
        "{}: these are not there:\n  {}\n"
        "A recording is a EuRoC folder (with mav0/cam0 and mav0/imu0): put it there, or name the "
        "folder that holds the recordings with --recordings DIR. Keyframes are a log that "
        "pangea-vio --out-keyframes writes, or an earlier session's agent_<id>.lcm.",
        file.string(), fmt::join(missing, "\n  ")));
  }
  return script;
}

void CheckRate(const std::string& rate, const SessionScript& script) {
  for (const AgentScript& agent : script.agents) {
    if (agent.live && (rate == "max" || std::stod(rate) != 1)) {
      throw std::runtime_error(
          fmt::format("agent {} is live: its session needs --rate 1", agent.id));
    }
  }
}

void PlaceDisconnects(const std::string& rate, SessionScript* script) {
  for (const Fault& fault : script->faults) {
    for (AgentScript& agent : script->agents) {
      if (agent.id != fault.disconnect) {
        continue;
      }
      if (rate == "max") {
        throw std::runtime_error(
            "a session with a 'disconnect' needs a --rate in numbers: at max there is no session "
            "time");
      }
      if (!agent.link) {
        agent.link.emplace();
      }
      const double seconds_per_second = std::stod(rate);
      agent.link->partitions.push_back(
          {fault.at_s / seconds_per_second, fault.seconds / seconds_per_second});
    }
  }
}

}  // namespace pangea::session
