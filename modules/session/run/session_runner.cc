#include "session/run/session_runner.h"

#include <fmt/format.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <functional>
#include <iterator>
#include <map>
#include <set>
#include <stdexcept>

#include "bus/process.h"
#include "files/make_folder.h"
#include "processes/child_process.h"
#include "processes/kept_processes.h"
#include "server/server_processes.h"
#include "session/anchors/anchor_app.h"
#include "session/processes/buses.h"
#include "session/processes/open_files.h"
#include "session/processes/player.h"
#include "session/run/session_monitor.h"
#include "session/run/session_processes.h"
#include "session/run/session_progress.h"

namespace pangea::session {
namespace {

namespace fs = std::filesystem;

constexpr double kStartTimeout_s = 20;  // time for the server processes to report
constexpr double kStuckAfter_s = 300;   // without a verification result, although not idle
// two HAVE intervals and a retransmission: lost last messages would be noticed
constexpr double kQuiet_s = 2.5;
constexpr double kStopGrace_s = 5;
constexpr size_t kFilesPerBus = 8;  // of which LCM opens six
constexpr size_t kFilesBeside = 64;
constexpr int kFewPoses = 2;  // exit code of pangea-vio: its recording gave few or no poses

class Runner {
 public:
  Runner(const SessionScript& script, const RunOptions& options)
      : script_(script),
        options_(options),
        faults_(script.faults),
        buses_(OpenBuses(script, options)),
        monitor_(buses_),
        anchors_(PlanAnchors(script)),
        progress_(isatty(STDOUT_FILENO) != 0),
        processes_(options.out, buses_) {
    for (const AgentScript& agent : script.agents) {
      players_.emplace_back().script = agent;
    }
  }

  RunSummary Run() {
    begin_ = Now();
    MakeFolder(options_.out / "logs");
    processes_.MakeKeys(script_);
    StartServer();
    StartLinks();
    Play();
    Drain();
    progress_.Finish();
    for (const std::string& fault : faults_.NotReached()) {
      summary_.notes.push_back(
          fmt::format("the fault '{}' did not happen: the session ended before", fault));
      progress_.PrintLine(summary_.notes.back());
    }
    std::ranges::copy(anchors_.NotPlaced(), std::back_inserter(summary_.failures));
    processes_.kept().StopAll(kStopGrace_s);
    summary_.wall_s = Now() - begin_;
    summary_.status = monitor_.statuses();
    summary_.cpu_s = monitor_.CpuSeconds();
    for (const Player& player : players_) {
      summary_.vio_wall_s[player.script.id] = player.ended_s - player.started_s;
      summary_.played_s[player.script.id] = monitor_.agent(player.script.id).recorded_s();
      // A player that gives up on its uplink leaves keyframes that never come. (One that is told to
      // end does not wait for it.)
      const int64_t lost = monitor_.Unacknowledged(player.script.id);
      if (lost > 0 && !stopped_ && !player.is_told_to_end) {
        summary_.failures.push_back(fmt::format(
            "agent {}: {} of its keyframes never reached the server", player.script.id, lost));
      }
    }
    return summary_;
  }

 private:
  // The monitor needs files for the server's bus and for each agent's.
  static Buses OpenBuses(const SessionScript& script, const RunOptions& options) {
    AllowOpenFiles(kFilesBeside + kFilesPerBus * (script.agents.size() + 1));
    return ChooseBuses(Ids(script, false), Ids(script, true), options.first_port);
  }

  static std::vector<int32_t> Ids(const SessionScript& script, bool only_with_bad_link) {
    std::vector<int32_t> ids;
    for (const AgentScript& agent : script.agents) {
      if (agent.link || !only_with_bad_link) {
        ids.push_back(agent.id);
      }
    }
    return ids;
  }

  void StartServer() {
    processes_.StartServer(script_.options, options_.journal);
    server_names_.assign(std::begin(kServerProcesses), std::end(kServerProcesses));
    WaitUntil("server processes", [this] { return monitor_.Idle(server_names_, 0); });
  }

  void WaitUntil(const std::string& what, const std::function<bool()>& are_up) {
    const double deadline = Now() + kStartTimeout_s;
    while (!are_up() && !StopRequested()) {
      if (Now() > deadline) {
        throw std::runtime_error(
            fmt::format("the {} did not come up within {} s; their output is in {}", what,
                        kStartTimeout_s, (options_.out / "logs").string()));
      }
      monitor_.Handle(50);
      Revive();
      if (!summary_.failures.empty()) {
        throw std::runtime_error(summary_.failures.front());
      }
    }
  }

  void StartLinks() {
    for (const AgentScript& agent : script_.agents) {
      anchors_.Join(agent, &monitor_.agent_bus(agent.id));
      processes_.StartUplink(agent);
    }
    // An uplink misses the first map of a player that is faster than its start.
    WaitUntil("uplinks", [this] { return monitor_.HaveReported(UplinkNames()); });
  }

  std::vector<std::string> UplinkNames() const {
    std::vector<std::string> names;
    for (const AgentScript& agent : script_.agents) {
      names.push_back(fmt::format("uplink_{}", agent.id));
    }
    return names;
  }

  // A killed player of stored keyframes starts again from the start; the uplink ignores repeats.
  void StartPlayer(Player& player) {
    const int32_t id = player.script.id;
    const bool stored = !player.script.keyframes.empty();
    std::vector<std::string> argv = {
        SiblingProgram(stored ? "pangea-keyframe-player" : "pangea-vio"), "--agent",
        std::to_string(id), "--bus", buses_.agents.at(id)};
    const std::vector<std::string> input = InputOf(player, options_.rate);
    argv.insert(argv.end(), input.begin(), input.end());
    const std::string name = fmt::format("{}_{}", stored ? "keyframes" : "vio", id);
    if (player.script.vio_options) {
      argv.insert(argv.end(),
                  {"--options", processes_.WriteOptions(name, *player.script.vio_options)});
    }
    player.child.emplace(name, std::move(argv), options_.out / "logs" / (name + ".txt"));
    if (player.started_s == 0) {
      player.started_s = Now();
      if (player.script.live) {
        progress_.PrintLine(DescribeLive(player.script, buses_.agents.at(id)));
      }
    }
  }

  // Session time, seconds: wall time multiplied by the rate; at rate max, the recording time of the
  // furthest agent.
  double SessionTime() const {
    if (options_.rate != "max") {
      return (Now() - play_begin_) * std::stod(options_.rate);
    }
    double furthest = 0;
    for (const Player& player : players_) {
      if (player.child) {
        furthest = std::max(furthest,
                            player.script.delay_s + monitor_.agent(player.script.id).recorded_s());
      }
    }
    return furthest;
  }

  // At rate max session time stops while no agent plays.
  bool SessionTimeStops() const {
    return options_.rate == "max" && std::ranges::none_of(players_, [](const Player& player) {
             return player.child && !player.done();
           });
  }

  void Play() {
    play_begin_ = Now();
    const auto done = [](const Player& player) { return player.done(); };
    // At rate max there is no session time after the last recording.
    const auto faults_to_come = [&] {
      return options_.rate != "max" && SessionTime() < faults_.end_s();
    };
    while ((!std::all_of(players_.begin(), players_.end(), done) || faults_to_come()) &&
           !StopRequested()) {
      for (Player& player : players_) {
        const bool due = player.script.delay_s <= 0 || SessionTime() >= player.script.delay_s ||
                         SessionTimeStops();
        if (!player.child && due) {
          StartPlayer(player);
        }
        WatchPlayer(player);
      }
      Step();
    }
    EndPlayers();
  }

  // Ctrl-C is the normal end of a live agent, but an interruption of recordings.
  void EndPlayers() {
    bool ends_live = false, ends_others = false;
    for (Player& player : players_) {
      if (!player.done()) {
        (player.script.live ? ends_live : ends_others) = true;
      }
      if (player.child && !player.done()) {
        player.child->Stop(kStopGrace_s);
        player.ended_s = Now();
      }
    }
    stopped_ = StopRequested();
    interrupted_ = stopped_ && (ends_others || !ends_live);
    if (interrupted_) {
      summary_.failures.emplace_back("interrupted: the recordings were not played to their end");
    } else if (stopped_) {
      progress_.PrintLine("the server works off what has come; Ctrl-C again ends it at once");
    }
  }

  void WatchPlayer(Player& player) {
    if (player.child && player.IsOver() && !player.is_told_to_end) {
      player.is_told_to_end = true;
      player.child->Signal(SIGINT);
    }
    const auto exit = player.child ? player.child->Poll() : std::nullopt;
    if (!exit || player.done()) {
      return;
    }
    // The rest of the recording after a killed vio may be too short for an initialisation.
    const bool is_rest = player.restarts > 0 && exit->code == kFewPoses;
    if (exit->code == 0 || is_rest || player.is_told_to_end || StopRequested()) {
      player.ended_s = Now();
    } else if (exit->signal != 0 && player.restarts < KeptProcesses::kMaxRestarts) {
      // Killed: the same agent continues at the same place of the recording, in a new map.
      ++player.restarts;
      summary_.restarted.push_back(player.child->name());
      player.played_before_s = monitor_.agent(player.script.id).recorded_s();
      monitor_.ForgetPublished(player.script.id);
      StartPlayer(player);
    } else {
      player.ended_s = Now();
      summary_.failures.push_back(
          fmt::format("agent {}: {}", player.script.id, player.child->LastLine()));
      progress_.PrintLine(summary_.failures.back());
    }
  }

  void Revive() {
    for (const KeptProcesses::Revived& revived : processes_.kept().Revive()) {
      if (revived.given_up) {
        summary_.failures.push_back(fmt::format(
            "{} ended {} times and was given up ({}); its output is in {}", revived.name,
            revived.unexpected, revived.why, (options_.out / "logs").string()));
        progress_.PrintLine(summary_.failures.back());
      } else {
        progress_.PrintLine(
            fmt::format("{} ended ({}); starting it again", revived.name, revived.why));
        summary_.restarted.push_back(revived.name);
      }
    }
  }

  ChildProcess* Find(const std::string& name) {
    if (ChildProcess* kept = processes_.kept().Find(name)) {
      return kept;
    }
    for (Player& player : players_) {
      if (player.child && player.child->name() == name && !player.done()) {
        return &*player.child;
      }
    }
    return nullptr;
  }

  void InjectFaults() {
    for (const std::string& name : faults_.TakeKills(SessionTime())) {
      if (ChildProcess* child = Find(name)) {
        child->Signal(SIGKILL);
      }
      processes_.kept().ExpectEnd(name);
    }
    std::set<std::string> full;
    if (!SessionTimeStops()) {
      full = faults_.DisksFull(SessionTime());
    }
    for (const std::string& name : faults_.DisksEverFull()) {
      if (ChildProcess* child = Find(name)) {
        SetDiskFull(child->pid(), full.contains(name));
      }
    }
  }

  // A full disk is reported in a status, which nobody reads while the session runs: print it. The
  // process continues when there is room again.
  void TellRefusedDisks() {
    for (const auto& [name, status] : monitor_.statuses()) {
      if (status.summary.find("DISK REFUSES WRITES") != std::string::npos &&
          refused_disks_.insert(name).second) {
        progress_.PrintLine(fmt::format(
            "{}: THE DISK REFUSES WRITES: make room in {}, and it goes on; Ctrl-C ends the session",
            name, options_.out.string()));
      }
    }
  }

  void Step() {
    InjectFaults();
    monitor_.Handle(100);
    anchors_.Step();
    Revive();
    TellRefusedDisks();
    std::vector<AgentLine> lines;
    for (const Player& player : players_) {
      lines.push_back({player.script.id, player.child.has_value(), player.done()});
    }
    progress_.Update(lines, monitor_, Now() - begin_);
  }

  // The processes that report when they have nothing to do.
  std::vector<std::string> Working() const {
    std::vector<std::string> names = server_names_;
    std::ranges::copy(UplinkNames(), std::back_inserter(names));
    std::erase_if(names,
                  [this](const std::string& name) { return processes_.kept().GivenUp(name); });
    return names;
  }

  // Waits until every process has finished its work. A server that still publishes verification
  // results is slow, not stuck, so it is given more time.
  void Drain() {
    const double patience_s = interrupted_ ? 2 * kQuiet_s : kStuckAfter_s;
    const int most_signals = stopped_ ? 1 : 0;  // the first signal only ended the agents
    double deadline = Now() + patience_s;
    int results = monitor_.num_results();
    while (!monitor_.Idle(Working(), kQuiet_s)) {
      if (StopSignals() > most_signals) {
        summary_.failures.emplace_back("interrupted: the server had not worked off what had come");
        return;
      }
      if (!interrupted_ && monitor_.num_results() > results) {
        results = monitor_.num_results();
        deadline = Now() + patience_s;
      }
      if (Now() > deadline) {
        if (!interrupted_) {
          summary_.failures.push_back(fmt::format(
              "the server is not idle {} s after its last verification result", kStuckAfter_s));
        }
        return;
      }
      Step();
    }
  }

  const SessionScript& script_;
  RunOptions options_;
  FaultSchedule faults_;
  Buses buses_;
  SessionMonitor monitor_;
  AnchorApp anchors_;
  SessionProgress progress_;
  SessionProcesses processes_;
  std::vector<Player> players_;
  std::vector<std::string> server_names_;
  std::set<std::string> refused_disks_;  // processes already reported
  bool stopped_ = false;                 // a signal came while agents played
  bool interrupted_ = false;             // ... and recordings were played
  RunSummary summary_;
  double begin_ = 0;
  double play_begin_ = 0;
};

}  // namespace

RunSummary RunSession(const SessionScript& script, const RunOptions& options) {
  InstallSignalHandlers();
  return Runner(script, options).Run();
}

}  // namespace pangea::session
