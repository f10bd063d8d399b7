#pragma once

// The log of a process on stderr, for people: one line at its start, one when the summary of its
// status changes, and one for each new reason to refuse a message. Before StartLog nothing is
// written, so tests and replays are silent.

#include <cstdint>
#include <optional>
#include <string>

namespace pangea {

// Turns the log on and writes "pangea-fusion: started; bus udpm://..., options fusion.yaml" (`with`
// follows "started; "). Call it from main().
void StartLog(const std::string& program, const std::string& with);
// Writes "process: line"; nothing before StartLog.
void Log(const std::string& process, const std::string& line);

// Decides which status summaries get a line in the log: those that differ from the last logged one
// in more than numbers, and at most one per kInterval_us.
class StateChanges {
 public:
  static constexpr int64_t kInterval_us = 5'000'000;

  std::optional<std::string> Take(int64_t now_utime, const std::string& summary);

 private:
  std::string told_;  // the last logged summary, without its digits
  int64_t next_utime_ = 0;
};

}  // namespace pangea
