#pragma once

// A child process with its output in a file: start, poll, stop. Linux only.

#include <sys/types.h>

#include <chrono>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace pangea {

class ChildProcess {
 public:
  struct Exit {
    int code = 0;    // exit code, or 128 + signal
    int signal = 0;  // the signal that ended it; 0 if it exited by itself
  };

  // Starts argv[0] with stdout and stderr appended to `output`; no other file of the parent is
  // inherited. The child dies with its parent, and ignores Ctrl-C from the terminal: the session
  // ends its children in order. Throws std::runtime_error if it cannot be started.
  ChildProcess(std::string name, std::vector<std::string> argv, std::filesystem::path output);
  ~ChildProcess();  // kills the process if it still runs
  ChildProcess(ChildProcess&& other) noexcept;
  ChildProcess& operator=(ChildProcess&&) = delete;

  const std::string& name() const { return name_; }
  pid_t pid() const { return pid_; }
  // Its exit; empty while it runs.
  std::optional<Exit> Poll();
  bool running() { return !Poll().has_value(); }
  void Signal(int signal);
  // Sends SIGINT, and SIGKILL after the grace period.
  void Stop(double grace_s);
  // For a process that has its signal already: waits, and sends SIGKILL after the grace period.
  void WaitForEnd(double grace_s);
  // Last non-empty line of its output: usually the reason of its end.
  std::string LastLine() const;
  // For an ended process: "exit code 1: <its last line>", "signal 9: ...".
  std::string HowItEnded();
  // For an ended process: how long it ran, until Poll saw the end.
  double RanSeconds() const;

 private:
  std::string name_;
  std::filesystem::path output_;
  pid_t pid_ = -1;
  std::optional<Exit> exit_;
  std::chrono::steady_clock::time_point started_ = std::chrono::steady_clock::now();
  std::chrono::steady_clock::time_point ended_;
};

// Directory of the running program, which contains the other programs.
std::filesystem::path ProgramDirectory();
// Full path of another program there. Throws std::runtime_error if it is missing.
std::string SiblingProgram(const std::string& name);
// Full path of a program on PATH; empty if there is none.
std::optional<std::filesystem::path> FindOnPath(const std::string& program);

}  // namespace pangea
