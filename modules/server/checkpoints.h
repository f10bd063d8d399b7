#pragma once

// Writes checkpoints of the server's processes, so that the next start reads little of the journal.
// Each is written by a second run of the process' program, which reads the journal and exits; one
// after another, while the server runs and after it has ended.

#include <cstdint>
#include <deque>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "processes/child_process.h"

namespace pangea {

class Checkpoints {
 public:
  // `logs`: folder for checkpoints.txt, the output of these runs.
  Checkpoints(std::filesystem::path folder, std::filesystem::path journal,
              const std::filesystem::path& logs);

  // Additional arguments of a process, for its own start and for the run that writes; empty if the
  // process has no checkpoint.
  std::vector<std::string> ArgumentsOf(const std::string& process) const;
  // Registers a process with the command line it was started with.
  void Add(const std::string& process, std::vector<std::string> argv);

  // The process was given up. Its checkpoint may be why, or a later program may make a better state
  // of the journal; so it is removed, and not written again. False if there is none.
  bool Drop(const std::string& process);

  // Call about every 100 ms while the server runs; `now_s`: steady clock.
  void Tick(double now_s);
  // Call when the server's processes have ended: writes all checkpoints that are due, until done or
  // until another signal comes.
  void Finish();

 private:
  struct Writer {
    std::string process;
    std::vector<std::string> argv;
  };
  int64_t JournalBytes() const;
  void BeginRound();
  // Starts the next run with this nice value, if none runs. True while one runs or is due.
  bool Advance(int niceness);

  const std::filesystem::path folder_;
  const std::filesystem::path journal_;
  const std::filesystem::path log_;
  std::vector<Writer> writers_;
  std::deque<Writer> to_run_;
  std::optional<ChildProcess> running_;
  std::optional<double> began_s_;         // start of the server
  std::optional<int64_t> journal_bytes_;  // size at the newest round
};

}  // namespace pangea
