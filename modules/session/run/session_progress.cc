#include "session/run/session_progress.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <iostream>

namespace pangea::session {
namespace {

constexpr double kTerminalInterval_s = 0.5;
constexpr double kFileInterval_s = 10;

}  // namespace

std::string DescribeAgent(const AgentLine& agent, const AgentProgress& progress) {
  if (!agent.started) {
    return fmt::format("agent {:<4} waiting to start", agent.id);
  }
  std::string state = progress.fused_with.empty()
                          ? "not fused"
                          : fmt::format("fused with {}", fmt::join(progress.fused_with, ", "));
  if (!progress.tracking && !agent.done) {
    state = progress.reason.empty() ? "starting" : progress.reason;
  }
  return fmt::format("agent {:<4} {:7.1f} s {:5d} keyframes   {:<24} drift {:.3f} m{}", agent.id,
                     progress.recorded_s(), progress.keyframes, state, progress.drift_m,
                     agent.done ? "   done" : "");
}

void SessionProgress::Update(const std::vector<AgentLine>& agents, const SessionMonitor& monitor,
                             double elapsed_s) {
  if (elapsed_s - drawn_at_s_ < (is_terminal_ ? kTerminalInterval_s : kFileInterval_s)) {
    return;
  }
  drawn_at_s_ = elapsed_s;
  std::vector<std::string> lines;
  for (const AgentLine& agent : agents) {
    lines.push_back(DescribeAgent(agent, monitor.agent(agent.id)));
  }
  lines.push_back(fmt::format("server     {:7.1f} s   {} constraints accepted, {} refused",
                              elapsed_s, monitor.constraints_accepted(),
                              monitor.constraints_refused()));
  if (is_terminal_ && lines_drawn_ > 0) {
    std::cout << fmt::format("\033[{}A", lines_drawn_);
  }
  for (const std::string& line : lines) {
    std::cout << line << (is_terminal_ ? "\033[K\n" : "\n");
  }
  std::cout << std::flush;
  lines_drawn_ = lines.size();
}

void SessionProgress::PrintLine(const std::string& line) {
  std::cout << line << (is_terminal_ ? "\033[K" : "") << std::endl;
  lines_drawn_ = 0;
}

void SessionProgress::Finish() {
  drawn_at_s_ = -1e9;
  lines_drawn_ = 0;
}

}  // namespace pangea::session
