#pragma once

// A child process with its output in a file: start, look, stop. Linux only.

#include <sys/types.h>

#include <chrono>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace pangea::session {

class ChildProcess {
 public:
  struct Exit {
    int code = 0;    // exit code, or 128 + signal
    int signal = 0;  // the signal that ended it; 0 if it exited by itself
  };

  // Starts argv[0] with stdout and stderr appended to `output`, and no other file of the parent's
  // open. The child dies with its parent, and ignores the terminal's Ctrl-C: the session ends it in
  // order. Throws std::runtime_error when it
  // cannot be started.
  ChildProcess(std::string name, std::vector<std::string> argv, std::filesystem::path output);
  ~ChildProcess();  // kills what still runs
  ChildProcess(ChildProcess&& other) noexcept;
  ChildProcess& operator=(ChildProcess&&) = delete;

  const std::string& name() const { return name_; }
  pid_t pid() const { return pid_; }
  // Its exit, once it has ended.
  std::optional<Exit> Poll();
  bool running() { return !Poll().has_value(); }
  void Signal(int signal);
  // SIGINT, then SIGKILL after the grace period.
  void Stop(double grace_s);
  // Last non-empty line of its output: usually why it ended.
  std::string LastLine() const;
  // Of one that has: "exit code 1: <its last line>", "signal 9: ...".
  std::string HowItEnded();
  // Of one that has ended: for how long it ran, until Poll saw the end.
  double RanSeconds() const;

 private:
  std::string name_;
  std::filesystem::path output_;
  pid_t pid_ = -1;
  std::optional<Exit> exit_;
  std::chrono::steady_clock::time_point started_ = std::chrono::steady_clock::now();
  std::chrono::steady_clock::time_point ended_;
};

// Directory of the running program: its siblings are there.
std::filesystem::path ProgramDirectory();
// Full path of one of them. Throws std::runtime_error when it is not there.
std::string SiblingProgram(const std::string& name);
// Full path of a program on PATH, or nothing.
std::optional<std::filesystem::path> FindOnPath(const std::string& program);

}  // namespace pangea::session
