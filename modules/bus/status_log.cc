#include "bus/status_log.h"

#include <fmt/format.h>

#include <cctype>
#include <cstdio>

namespace pangea {
namespace {

bool is_on = false;

// Unlike fmt::print, this does not throw when the log's disk is full.
void Write(const std::string& line) { std::fputs(line.c_str(), stderr); }

std::string WithoutNumbers(const std::string& text) {
  std::string rest;
  for (const char c : text) {
    if (std::isdigit(static_cast<unsigned char>(c)) == 0) {
      rest += c;
    }
  }
  return rest;
}

}  // namespace

void StartLog(const std::string& program, const std::string& with) {
  is_on = true;
  Write(fmt::format("{}: started; {}\n", program, with));
}

void Log(const std::string& process, const std::string& line) {
  if (is_on) {
    Write(fmt::format("{}: {}\n", process, line));
  }
}

std::optional<std::string> StateChanges::Take(int64_t now_utime, const std::string& summary) {
  const std::string state = WithoutNumbers(summary);
  if (state == told_ || now_utime < next_utime_) {
    return std::nullopt;
  }
  told_ = state;
  next_utime_ = now_utime + kInterval_us;
  return summary;
}

}  // namespace pangea
