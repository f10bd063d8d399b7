#pragma once

// Shows on stderr how far a command is that takes more than a few seconds: on a terminal one line
// that is redrawn, in a file a line from time to time. Not thread safe. It uses the clock, so no
// result may depend on it.

#include <cstdint>
#include <functional>
#include <ostream>
#include <string>

namespace pangea {

class Progress {
 public:
  // `what`: the text before the count, such as the program's name.
  explicit Progress(std::string what);
  // For tests: with another stream, and a clock in seconds.
  Progress(std::string what, std::ostream& out, bool is_terminal, std::function<double()> clock);
  // Removes the line from the terminal.
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  // Shows for example "pangea-vio: 340 of 3638 images". It is cheap: call it for each item.
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
