#pragma once

// How far a command is that takes more than a few seconds, on stderr: one line that is redrawn on a
// terminal, a line now and then in a file. For one thread; knows the clock, so nothing may follow
// from it.

#include <cstdint>
#include <functional>
#include <ostream>
#include <string>

namespace pangea {

class Progress {
 public:
  // `what` stands before the count: a program's name.
  explicit Progress(std::string what);
  // With another stream and clock, seconds, for tests.
  Progress(std::string what, std::ostream& out, bool is_terminal, std::function<double()> clock);
  // Takes the line off the terminal: what follows stands alone.
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  // "pangea-vio: 340 of 3638 images". Cheap: call it at each one.
  void Update(int64_t done, int64_t all, const char* units);

 private:
  std::string what_;
  std::ostream& out_;
  bool is_terminal_;
  std::function<double()> clock_;
  double next_s_ = 0;
  bool drawn_ = false;
};

}  // namespace pangea
