#include "processes/child_process.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <limits>
#include <sstream>
#include <stdexcept>
#include <thread>
#include <utility>

namespace pangea {

ChildProcess::ChildProcess(std::string name, std::vector<std::string> argv,
                           std::filesystem::path output)
    : name_(std::move(name)), output_(std::move(output)) {
  std::vector<char*> arguments;
  for (std::string& argument : argv) {
    arguments.push_back(argument.data());
  }
  arguments.push_back(nullptr);
  const int out = open(output_.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644);
  if (out < 0) {
    throw std::runtime_error(
        fmt::format("{}: cannot be written: {}", output_.string(), std::strerror(errno)));
  }
  const pid_t parent = getpid();
  pid_ = fork();
  if (pid_ == 0) {
    // Only async-signal-safe calls between fork and exec.
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (getppid() != parent) {
      _exit(1);
    }
    setpgid(0, 0);
    dup2(out, STDOUT_FILENO);
    dup2(out, STDERR_FILENO);
    // LCM opens its sockets without close-on-exec. If a child inherited those of hundreds of buses,
    // its own would have numbers in the thousands, which lcm-logger's select() does not support.
    close_range(STDERR_FILENO + 1, std::numeric_limits<unsigned>::max(), 0);
    execv(arguments[0], arguments.data());
    _exit(127);
  }
  const int error = errno;
  close(out);
  if (pid_ < 0) {
    throw std::runtime_error(fmt::format("cannot start {}: {}", argv[0], std::strerror(error)));
  }
}

ChildProcess::ChildProcess(ChildProcess&& other) noexcept
    : name_(std::move(other.name_)),
      output_(std::move(other.output_)),
      pid_(std::exchange(other.pid_, -1)),
      exit_(other.exit_),
      started_(other.started_),
      ended_(other.ended_) {}

ChildProcess::~ChildProcess() {
  if (pid_ > 0 && running()) {
    kill(pid_, SIGKILL);
    waitpid(pid_, nullptr, 0);
  }
}

std::optional<ChildProcess::Exit> ChildProcess::Poll() {
  if (!exit_) {
    int status = 0;
    if (waitpid(pid_, &status, WNOHANG) == pid_) {
      exit_ = WIFSIGNALED(status) ? Exit{128 + WTERMSIG(status), WTERMSIG(status)}
                                  : Exit{WEXITSTATUS(status), 0};
      ended_ = std::chrono::steady_clock::now();
    }
  }
  return exit_;
}

void ChildProcess::Signal(int signal) {
  if (running()) {
    kill(pid_, signal);
  }
}

void ChildProcess::Stop(double grace_s) {
  Signal(SIGINT);
  WaitForEnd(grace_s);
}

void ChildProcess::WaitForEnd(double grace_s) {
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::duration<double>(grace_s);
  while (running()) {
    if (std::chrono::steady_clock::now() > deadline) {
      kill(pid_, SIGKILL);
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
}

std::string ChildProcess::LastLine() const {
  std::ifstream file(output_);
  std::string line, last;
  while (std::getline(file, line)) {
    if (!line.empty()) {
      last = line;
    }
  }
  return last;
}

std::string ChildProcess::HowItEnded() {
  const auto exit = Poll();
  return !exit ? "it runs"
               : fmt::format("{} {}: {}", exit->signal != 0 ? "signal" : "exit code",
                             exit->signal != 0 ? exit->signal : exit->code, LastLine());
}

double ChildProcess::RanSeconds() const {
  return std::chrono::duration<double>(ended_ - started_).count();
}

std::filesystem::path ProgramDirectory() {
  return std::filesystem::read_symlink("/proc/self/exe").parent_path();
}

std::string SiblingProgram(const std::string& name) {
  const std::filesystem::path path = ProgramDirectory() / name;
  if (!std::filesystem::exists(path)) {
    throw std::runtime_error(fmt::format(
        "{} is missing: build all programs (scripts/build release programs)", path.string()));
  }
  return path.string();
}

std::optional<std::filesystem::path> FindOnPath(const std::string& program) {
  const char* path = std::getenv("PATH");
  std::istringstream folders(path != nullptr ? path : "/usr/bin");
  for (std::string folder; std::getline(folders, folder, ':');) {
    const auto candidate = std::filesystem::path(folder) / program;
    if (access(candidate.c_str(), X_OK) == 0) {
      return candidate;
    }
  }
  return std::nullopt;
}

}  // namespace pangea
