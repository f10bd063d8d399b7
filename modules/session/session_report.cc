#include "session/session_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <iostream>
#include <map>

#include "bus/node.h"
#include "server_options/server_options.h"
#include "session/run/session_monitor.h"

namespace pangea::session {
namespace {

namespace fs = std::filesystem;

std::optional<int64_t> Counter(const RunSummary& summary, const std::string& process,
                               const std::string& name) {
  const auto status = summary.status.find(process);
  return status == summary.status.end() ? std::nullopt : CounterOf(status->second, name);
}

// The counters "up_taken", "up_delivered", ... of the agent's link emulator.
LinkRun LinkRunOf(const AgentScript& agent, const RunSummary& summary) {
  LinkRun link;
  link.conditions = Describe(*agent.link);
  const auto status = summary.status.find(fmt::format("link_emulator_{}", agent.id));
  if (status != summary.status.end()) {
    for (const counter_t& counter : status->second.counters) {
      if (counter.name.starts_with("up_")) {
        link.packets_up[counter.name.substr(3)] = counter.count;
      } else if (counter.name.starts_with("down_")) {
        link.packets_down[counter.name.substr(5)] = counter.count;
      }
    }
  }
  return link;
}

AgentRun RunOf(const AgentScript& script) {
  AgentRun run;
  run.id = script.id;
  run.recording = script.resolved.string();
  run.start_s = script.start_s;
  if (script.duration_s > 0 && !script.live) {  // a live agent's is not of its recording
    run.duration_s = script.duration_s;
  }
  return run;
}

// Session time in which an agent played. Recordings may be played at once, or one after another.
double PlayedSeconds(const SessionScript& script, const RunSummary& summary) {
  std::map<double, double> spans;  // end by begin
  for (const AgentScript& agent : script.agents) {
    if (const auto played = summary.played_s.find(agent.id); played != summary.played_s.end()) {
      double& end_s = spans[agent.delay_s];
      end_s = std::max(end_s, agent.delay_s + played->second);
    }
  }
  double seconds = 0, until_s = 0;
  for (const auto& [begin_s, end_s] : spans) {
    seconds += std::max(0.0, end_s - std::max(begin_s, until_s));
    until_s = std::max(until_s, end_s);
  }
  return seconds;
}

std::vector<WantedAnchor> WantedAnchors(const SessionScript& script) {
  std::vector<WantedAnchor> wanted;
  for (const AnchorScript& anchor : script.anchors) {
    wanted.push_back({anchor.agent, anchor.name});
  }
  return wanted;
}

SessionRecord RecordOf(const SessionScript& script) {
  SessionRecord session{{}, script.expect, WantedAnchors(script)};
  for (const AgentScript& agent : script.agents) {
    session.agents.push_back(RunOf(agent));
  }
  return session;
}

// Writes the report; returns its text and the expectations that were not met.
ReportOutcome OutcomeOf(const ReportInput& input, const fs::path& out, LogReadings* readings) {
  WrittenReport report = WriteReport(input, out.string(), readings);
  ReportOutcome outcome{std::move(report.text), {}, std::move(report.runs)};
  for (const CheckedExpectation& one : report.checked) {
    if (!one.met) {
      outcome.missed.push_back(
          fmt::format("expected {} {}, got {}", one.name, one.text, one.value));
    }
  }
  return outcome;
}

// In a replay no agent shows anchors: without the agents' logs there is no data.
void ForgetAnchorsOfAReplay(ReportInput* input) {
  if (std::ranges::any_of(input->agents,
                          [](const AgentRun& run) { return !run.bus_log.empty(); })) {
    return;
  }
  input->anchors.clear();
  if (std::erase_if(input->expect,
                    [](const auto& bound) { return bound.first.starts_with("anchor_"); }) > 0) {
    input->notes.emplace_back(
        "no log of an agent's bus: what is expected of anchors was not checked");
  }
}

// Notes the server's options that are not the defaults.
void NoteOptions(const fs::path& log, LogReadings* readings, ReportInput* input) {
  const LoggedOptions logged = ReadLoggedOptions({log}, readings);
  input->notes.insert(input->notes.end(), logged.notes.begin(), logged.notes.end());
  for (const std::string& other : OtherThanDefault(logged.options)) {
    input->notes.push_back(fmt::format("option {}", other));
  }
}

}  // namespace

ReportOutcome ReportRun(const SessionScript& script, const RunSummary& summary, const fs::path& out,
                        LogReadings* readings) {
  ReportInput input;
  input.server_log = (out / "session.lcm").string();
  for (const AgentScript& agent : script.agents) {
    AgentRun run = RunOf(agent);
    run.bus_log = (out / fmt::format("agent_{}.lcm", agent.id)).string();
    const std::string uplink = fmt::format("uplink_{}", agent.id);
    run.bytes_up = Counter(summary, uplink, "bytes_up");
    run.bytes_down = Counter(summary, uplink, "bytes_down");
    if (agent.link) {
      run.link = LinkRunOf(agent, summary);
    }
    const auto played = summary.played_s.find(agent.id);
    const auto wall = summary.vio_wall_s.find(agent.id);
    if (played != summary.played_s.end() && wall != summary.vio_wall_s.end() && wall->second > 0) {
      run.realtime_factor = played->second / wall->second;
    }
    input.agents.push_back(std::move(run));
  }
  // The largest possible real-time factor of a process: seconds of session per second of its CPU
  // time.
  const double played_s = PlayedSeconds(script, summary);
  for (const auto& [name, cpu_s] : summary.cpu_s) {
    if (cpu_s > 0 && played_s > 0) {
      input.realtime_factors[name] = played_s / cpu_s;
    }
  }
  for (const std::string& name : summary.restarted) {
    ++input.restarts[name];
  }
  input.notes = summary.failures;
  input.notes.insert(input.notes.end(), summary.notes.begin(), summary.notes.end());
  input.anchors = WantedAnchors(script);
  input.expect = script.expect;
  NoteOptions(input.server_log, readings, &input);
  ReportOutcome outcome = OutcomeOf(input, out, readings);
  SessionRecord record = RecordOf(script);
  for (AgentRun& agent : record.agents) {
    agent.maps = std::ranges::find(outcome.runs, agent.id, &AgentRun::id)->maps;
  }
  WriteSessionRecord(record, out);
  return outcome;
}

ReportOutcome ReportLog(const fs::path& log, const SessionRecord& known, const fs::path& out,
                        LogReadings* readings) {
  ReportInput input;
  input.server_log = log.string();
  input.agents = known.agents;
  input.anchors = known.anchors;
  input.expect = known.expect;
  for (AgentRun& run : input.agents) {  // the agents' logs are beside a session's own log
    const fs::path bus_log = log.parent_path() / fmt::format("agent_{}.lcm", run.id);
    run.bus_log = fs::exists(bus_log) ? bus_log.string() : std::string();
  }
  ForgetAnchorsOfAReplay(&input);
  NoteOptions(log, readings, &input);
  return OutcomeOf(input, out, readings);
}

int PrintReport(const ReportOutcome& outcome) {
  std::cout << outcome.text << std::flush;
  for (const std::string& missed : outcome.missed) {
    std::cerr << fmt::format("pangea-session: {}\n", missed);
  }
  return outcome.missed.empty() ? 0 : kMissed;
}

void WriteRecordings(const SessionScript& script, const fs::path& out) {
  WriteSessionRecord(RecordOf(script), out);
}

}  // namespace pangea::session
