#include "processes/kept_processes.h"

#include <fmt/format.h>
#include <signal.h>

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "bus/wall_clock.h"

namespace pangea {

bool QuickDeaths::Note(const std::string& why, double ran_s) {
  if (ran_s > kAtItsStart_s) {
    count_ = 0;
    return false;
  }
  count_ = why == why_ ? count_ + 1 : 1;
  why_ = why;
  return count_ >= kMaxQuickDeaths;
}

void RecentEnds::Note(double now_s) {
  ends_s_.push_back(now_s);
  while (ends_s_.front() <= now_s - kWindow_s) {
    ends_s_.pop_front();
  }
}

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
    const auto exit = kept.given_up ? std::nullopt : kept.child->Poll();
    if (!exit) {
      continue;
    }
    std::string why = kept.child->HowItEnded();
    kept.ever_ran |= kept.child->RanSeconds() > QuickDeaths::kAtItsStart_s;
    if (!std::exchange(kept.expects_end, false)) {
      kept.recent_ends.Note(SteadySeconds());
      kept.given_up = kept.quick_deaths.Note(why, kept.child->RanSeconds()) ||
                      kept.recent_ends.count() > kMaxRestarts;
    }
    const bool waited = std::exchange(kept.waits, false);
    if (!kept.given_up) {
      StartAgain(&kept, &why);
    }
    if (!waited || !kept.waits) {
      revived.push_back(
          {kept.child->name(), why, kept.given_up, kept.ever_ran, kept.recent_ends.count()});
    }
  }
  return revived;
}

// If the machine has no room for another process or log just now, the next Revive tries again.
void KeptProcesses::StartAgain(Kept* kept, std::string* why) const {
  try {
    const std::string name = kept->child->name();
    kept->child.emplace(ChildProcess(name, kept->argv, LogOf(name)));
  } catch (const std::runtime_error& error) {
    *why += fmt::format("; it waits to be started: {}", error.what());
    kept->waits = kept->expects_end = true;
  }
}

bool KeptProcesses::GivenUp(const std::string& name) const {
  return std::ranges::any_of(
      kept_, [&](const Kept& kept) { return kept.given_up && kept.child->name() == name; });
}

void KeptProcesses::StopAll(double grace_s) {
  for (const bool loggers : {false, true}) {
    std::vector<ChildProcess*> children;
    for (Kept& kept : kept_) {
      if (kept.child->name().starts_with("logger") == loggers) {
        children.push_back(&*kept.child);
      }
    }
    for (ChildProcess* child : children) {
      child->Signal(SIGINT);
    }
    for (ChildProcess* child : children) {
      child->WaitForEnd(grace_s);
    }
  }
}

}  // namespace pangea
