#pragma once

// The processes a session keeps alive: what ends is started again, until it has done so too often,
// or has ended at its start kMaxQuickDeaths times in a row, each time for the same reason: then it
// would never come up.

#include <deque>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "session/processes/child_process.h"

namespace pangea::session {

// Counts the deaths at the start of one process.
class QuickDeaths {
 public:
  static constexpr int kMaxQuickDeaths = 3;
  static constexpr double kAtItsStart_s = 10;

  // It ended, for this reason, after so many seconds. Whether starting it once more is in vain.
  bool Note(const std::string& why, double ran_s);

 private:
  std::string why_;
  int count_ = 0;
};

class KeptProcesses {
 public:
  static constexpr int kMaxRestarts = 20;  // of one process; then it is given up

  // What each says goes to <name>.txt there.
  explicit KeptProcesses(std::filesystem::path logs);

  void Start(const std::string& name, std::vector<std::string> argv);
  // Null where there is none of that name.
  ChildProcess* Find(const std::string& name);
  // Its next end is one that the session wants, and counts for nothing.
  void ExpectEnd(const std::string& name);

  struct Revived {
    std::string name;
    std::string why;        // how it ended, for people
    bool given_up = false;  // it is not started again
    int unexpected = 0;     // how often it ended and was not meant to
  };
  // Starts those again that have ended.
  std::vector<Revived> Revive();
  bool GivenUp(const std::string& name) const;

  // Sources first, loggers last, so that nothing said is missed.
  void StopAll(double grace_s);

 private:
  struct Kept {
    std::vector<std::string> argv;
    std::optional<ChildProcess> child;
    QuickDeaths quick_deaths;
    int unexpected = 0;
    bool expects_end = false;
    bool given_up = false;
  };
  std::filesystem::path LogOf(const std::string& name) const;

  std::filesystem::path logs_;
  std::deque<Kept> kept_;
};

}  // namespace pangea::session
