#pragma once

// What a process tells people on stderr, where a terminal or a file of the session's shows it: one
// line at its start, one when what its status says changes, and each reason to refuse a message
// once. Silent until StartLog, so that tests and replays are.

#include <cstdint>
#include <optional>
#include <string>

namespace pangea {

// "pangea-fusion: started; bus udpm://..., options fusion.yaml". Turns the log on. From main().
void StartLog(const std::string& program, const std::string& with);
// A line of a process' log; nothing before StartLog.
void Log(const std::string& process, const std::string& line);

// Which of a status' summaries are worth a line: those that differ in more than their numbers, at
// most one in kInterval_us; what holds by then is told.
class StateChanges {
 public:
  static constexpr int64_t kInterval_us = 5'000'000;

  std::optional<std::string> Take(int64_t now_utime, const std::string& summary);

 private:
  std::string told_;  // without its numbers
  int64_t next_utime_ = 0;
};

}  // namespace pangea
