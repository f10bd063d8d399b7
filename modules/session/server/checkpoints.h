#pragma once

// The checkpoints of a server's processes, so that its next start reads little of the journal: each
// is written by a second run of the process' program, which reads the journal and ends; one after
// the other, while the server runs and when it has ended.

#include <cstdint>
#include <deque>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "session/processes/child_process.h"

namespace pangea::session {

class Checkpoints {
 public:
  // `logs`: where checkpoints.txt gets what the runs say.
  Checkpoints(std::filesystem::path folder, std::filesystem::path journal,
              const std::filesystem::path& logs);

  // Arguments of a process, for its own start and for the run that writes; none for one that keeps
  // no checkpoint.
  std::vector<std::string> ArgumentsOf(const std::string& process) const;
  // The process was started with these.
  void Add(const std::string& process, std::vector<std::string> argv);

  // Every 100 ms or so while the server runs; steady clock.
  void Tick(double now_s);
  // When its processes have ended: all that is due, until that is done or a further signal comes.
  void Finish();

 private:
  struct Writer {
    std::string process;
    std::vector<std::string> argv;
  };
  int64_t JournalBytes() const;
  void BeginRound();
  // Whether one is still at work, or to be. Those that it starts get this nice value.
  bool Advance(int niceness);

  const std::filesystem::path folder_;
  const std::filesystem::path journal_;
  const std::filesystem::path log_;
  std::vector<Writer> writers_;
  std::deque<Writer> to_run_;
  std::optional<ChildProcess> running_;
  std::optional<double> began_s_;         // the server
  std::optional<int64_t> journal_bytes_;  // at the newest round
};

}  // namespace pangea::session
