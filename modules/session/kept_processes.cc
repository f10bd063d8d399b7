#include "session/kept_processes.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace pangea::session {
KeptProcesses::KeptProcesses(std::filesystem::path logs) : logs_(std::move(logs)) {}

std::filesystem::path KeptProcesses::LogOf(const std::string& name) const {
  return logs_ / (name + ".txt");
}

void KeptProcesses::Start(const std::string& name, std::vector<std::string> argv) {
  Kept& kept = kept_.emplace_back();
  kept.argv = std::move(argv);
  kept.child.emplace(name, kept.argv, LogOf(name));
}

ChildProcess* KeptProcesses::Find(const std::string& name) {
  const auto found =
      std::ranges::find_if(kept_, [&](const Kept& kept) { return kept.child->name() == name; });
  return found == kept_.end() ? nullptr : &*found->child;
}

void KeptProcesses::ExpectEnd(const std::string& name) {
  for (Kept& kept : kept_) {
    kept.expects_end |= kept.child->name() == name;
  }
}

std::vector<KeptProcesses::Revived> KeptProcesses::Revive() {
  std::vector<Revived> revived;
  for (Kept& kept : kept_) {
    const auto exit = kept.child->Poll();
    if (!exit || kept.unexpected >= kMaxRestarts) {
      continue;
    }
    const std::string name = kept.child->name();
    const std::string how = exit->signal != 0 ? fmt::format("signal {}", exit->signal)
                                              : fmt::format("exit code {}", exit->code);
    const std::string why = fmt::format("{}: {}", how, kept.child->LastLine());
    kept.unexpected += kept.expects_end ? 0 : 1;
    kept.expects_end = false;
    kept.child.emplace(name, kept.argv, LogOf(name));
    revived.push_back({name, why, kept.unexpected == kMaxRestarts, kept.unexpected});
  }
  return revived;
}

void KeptProcesses::StopAll(double grace_s) {
  for (const bool loggers : {false, true}) {
    for (auto kept = kept_.rbegin(); kept != kept_.rend(); ++kept) {
      if (kept->child->name().starts_with("logger") == loggers) {
        kept->child->Stop(grace_s);
      }
    }
  }
}

}  // namespace pangea::session
