#include "report/session_record.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>
#include <stdexcept>

#include "files/text_file.h"

namespace pangea {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr char kFile[] = "recordings.json";

AgentRun RunOf(const json& agent) {
  AgentRun run;
  run.id = agent.at("id").get<int32_t>();
  run.recording = agent.at("recording").get<std::string>();
  run.start_s = agent.at("start").get<double>();
  const double duration_s = agent.at("duration").get<double>();
  if (duration_s > 0) {
    run.duration_s = duration_s;
  }
  if (agent.contains("maps")) {
    run.maps.emplace();
    for (const int64_t opened_utime : agent.at("maps")) {
      run.maps->insert({run.id, opened_utime});
    }
  }
  return run;
}

fs::path OwnFile(const fs::path& log) { return log.string() + "." + kFile; }

void Write(const SessionRecord& session, const fs::path& file) {
  json agents = json::array();
  for (const AgentRun& agent : session.agents) {
    const std::string recording =
        agent.recording.empty() ? std::string() : fs::absolute(agent.recording).string();
    agents.push_back({{"id", agent.id},
                      {"recording", recording},
                      {"start", agent.start_s},
                      {"duration", agent.duration_s.value_or(0)}});  // 0: to its end
    if (agent.maps) {                                                // by opened utime
      json& maps = agents.back()["maps"] = json::array();
      for (const MapId& map : *agent.maps) {
        maps.push_back(map.opened_utime);
      }
    }
  }
  json anchors = json::array();
  for (const WantedAnchor& anchor : session.anchors) {
    anchors.push_back({{"agent", anchor.agent}, {"name", anchor.name}});
  }
  WriteTextFile(file,
                json{{"agents", agents}, {"anchors", anchors}, {"expect", session.expect}}.dump(
                    2, ' ', false, json::error_handler_t::replace) +
                    "\n");
}

}  // namespace

void WriteSessionRecord(const SessionRecord& session, const fs::path& folder) {
  Write(session, folder / kFile);
}

void KeepRecordings(const std::vector<fs::path>& logs, const fs::path& out) {
  SessionRecord kept;
  for (const AgentRun& agent : ReadSessionRecord(logs).agents) {
    const bool is_kept = std::ranges::any_of(kept.agents, [&agent](const AgentRun& other) {
      return other.id == agent.id && other.recording == agent.recording && other.maps == agent.maps;
    });
    if (!is_kept) {
      kept.agents.push_back(agent);
    }
  }
  if (!kept.agents.empty()) {
    Write(kept, OwnFile(out));
  } else {
    fs::remove(OwnFile(out));  // left by an earlier log of this name
  }
}

SessionRecord ReadSessionRecord(const std::vector<fs::path>& logs) {
  SessionRecord session;
  std::set<fs::path> seen;
  for (const fs::path& log : logs) {
    fs::path file = OwnFile(fs::absolute(log));
    if (!Exists(file)) {
      file = fs::absolute(log).parent_path() / kFile;
    }
    if (!Exists(file) || !seen.insert(file).second) {
      continue;
    }
    try {
      const json remembered = json::parse(ReadTextFile(file));
      for (const json& agent : remembered.at("agents")) {
        session.agents.push_back(RunOf(agent));
      }
      for (const json& anchor : remembered.value("anchors", json::array())) {
        session.anchors.push_back(
            {anchor.at("agent").get<int32_t>(), anchor.at("name").get<std::string>()});
      }
      // Several sessions together have no expectations.
      session.expect =
          seen.size() == 1 ? remembered.value("expect", Expectations()) : Expectations();
    } catch (const json::exception& error) {
      throw std::runtime_error(fmt::format("{}: {}", file.string(), error.what()));
    }
  }
  return session;
}

void GiveRecording(int32_t agent_id, const std::string& folder, SessionRecord* session) {
  if (std::ranges::find(session->agents, agent_id, &AgentRun::id) == session->agents.end()) {
    session->agents.emplace_back().id = agent_id;
  }
  for (AgentRun& agent : session->agents) {
    agent.recording = agent.id == agent_id ? folder : agent.recording;
  }
}

std::optional<std::string> RecordingOf(const MapId& map, const SessionRecord& session) {
  for (const AgentRun& agent : session.agents) {
    if (agent.id == map.agent_id && (!agent.maps || agent.maps->contains(map)) &&
        !agent.recording.empty() && Exists(agent.recording)) {
      return agent.recording;
    }
  }
  return std::nullopt;
}

}  // namespace pangea
