#pragma once

// The processes that a session keeps alive: a process that ends is restarted. It is given up if it
// has ended too often within an hour, or kMaxQuickDeaths times in a row soon after its start and
// for the same reason, since it would then never start.

#include <deque>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "processes/child_process.h"

namespace pangea {

// Counts how often one process ends soon after its start.
class QuickDeaths {
 public:
  static constexpr int kMaxQuickDeaths = 3;
  static constexpr double kAtItsStart_s = 10;

  // Notes that the process ended, with this reason, after `ran_s` seconds. True if another start
  // would be useless.
  bool Note(const std::string& why, double ran_s);

 private:
  std::string why_;
  int count_ = 0;
};

// Counts how often one process ended lately. A rate, because one end a week over months is no
// reason to give a process up.
class RecentEnds {
 public:
  static constexpr double kWindow_s = 3600;

  // Notes an end; `now_s` must not decrease.
  void Note(double now_s);
  // Number of ends within the window before the last one noted.
  int count() const { return static_cast<int>(ends_s_.size()); }

 private:
  std::deque<double> ends_s_;
};

class KeptProcesses {
 public:
  // per process within RecentEnds::kWindow_s; then it is given up
  static constexpr int kMaxRestarts = 20;

  // `logs`: the folder for the processes' output, <name>.txt.
  explicit KeptProcesses(std::filesystem::path logs);

  void Start(const std::string& name, std::vector<std::string> argv);
  // Null if there is none with that name.
  ChildProcess* Find(const std::string& name);
  // The next end of this process is intended, and is not counted.
  void ExpectEnd(const std::string& name);

  struct Revived {
    std::string name;
    std::string why;        // how it ended, for people
    bool given_up = false;  // it is not started again
    bool ever_ran = false;  // one of its runs was longer than QuickDeaths::kAtItsStart_s
    int unexpected = 0;     // number of unintended ends within RecentEnds::kWindow_s
  };
  // Restarts the processes that have ended.
  std::vector<Revived> Revive();
  bool GivenUp(const std::string& name) const;

  // Stops all at the same time, but the loggers last, so that no message is missed.
  void StopAll(double grace_s);

 private:
  struct Kept {
    std::vector<std::string> argv;
    std::optional<ChildProcess> child;
    QuickDeaths quick_deaths;
    RecentEnds recent_ends;
    bool expects_end = false;
    bool ever_ran = false;
    bool given_up = false;
    bool waits = false;  // the last attempt to start it again failed
  };
  void StartAgain(Kept* kept, std::string* why) const;
  std::filesystem::path LogOf(const std::string& name) const;

  std::filesystem::path logs_;
  std::deque<Kept> kept_;
};

}  // namespace pangea
