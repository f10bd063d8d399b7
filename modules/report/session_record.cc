#include "report/session_record.h"

#include <fmt/format.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <set>
#include <stdexcept>

#include "recording/text_file.h"

namespace pangea::session {
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
  return run;
}

}  // namespace

void WriteSessionRecord(const SessionRecord& session, const fs::path& folder) {
  json agents = json::array();
  for (const AgentRun& agent : session.agents) {
    const std::string recording =
        agent.recording.empty() ? std::string() : fs::absolute(agent.recording).string();
    agents.push_back({{"id", agent.id},
                      {"recording", recording},
                      {"start", agent.start_s},
                      {"duration", agent.duration_s.value_or(0)}});  // 0: to its end
  }
  WriteTextFile(folder / kFile,
                json{{"agents", agents}, {"expect", session.expect}}.dump(2) + "\n");
}

SessionRecord ReadSessionRecord(const std::vector<fs::path>& logs) {
  SessionRecord session;
  std::set<fs::path> seen;
  for (const fs::path& log : logs) {
    const fs::path file = fs::absolute(log).parent_path() / kFile;
    if (!fs::exists(file) || !seen.insert(file).second) {
      continue;
    }
    try {
      std::ifstream stream(file);
      const json remembered = json::parse(stream);
      for (const json& agent : remembered.at("agents")) {
        session.agents.push_back(RunOf(agent));
      }
      // Of several sessions together nothing was expected.
      session.expect =
          seen.size() == 1 ? remembered.value("expect", Expectations()) : Expectations();
    } catch (const json::exception& error) {
      throw std::runtime_error(fmt::format("{}: {}", file.string(), error.what()));
    }
  }
  return session;
}

std::map<int32_t, std::string> RecordingsAtHand(const SessionRecord& session) {
  std::map<int32_t, std::string> folders;
  for (const AgentRun& agent : session.agents) {
    if (!agent.recording.empty() && fs::exists(agent.recording)) {
      folders.emplace(agent.id, agent.recording);
    }
  }
  return folders;
}

}  // namespace pangea::session
