#include "files/progress.h"

#include <fmt/format.h>
#include <unistd.h>

#include <chrono>
#include <iostream>
#include <utility>

namespace pangea {
namespace {

// Nothing is shown before this time, so a quick command shows nothing.
constexpr double kFirst_s = 2;
constexpr double kTerminalInterval_s = 0.2;
constexpr double kFileInterval_s = 10;

double SteadySeconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

}  // namespace

Progress::Progress(std::string what)
    : Progress(std::move(what), std::cerr, isatty(STDERR_FILENO) == 1, SteadySeconds) {}

Progress::Progress(std::string what, std::ostream& out, bool is_terminal,
                   std::function<double()> clock)
    : what_(std::move(what)),
      out_(out),
      is_terminal_(is_terminal),
      clock_(std::move(clock)),
      next_s_(clock_() + kFirst_s) {}

Progress::~Progress() {
  if (drawn_ && is_terminal_) {
    out_ << "\r\033[K" << std::flush;
  }
}

void Progress::Update(int64_t done, int64_t all, const char* units) {
  const double now_s = clock_();
  if (now_s < next_s_) {
    return;
  }
  next_s_ = now_s + (is_terminal_ ? kTerminalInterval_s : kFileInterval_s);
  drawn_ = true;
  const std::string line = fmt::format("{}: {} of {} {}", what_, done, all, units);
  out_ << (is_terminal_ ? "\r" + line + "\033[K" : line + "\n") << std::flush;
}

}  // namespace pangea
