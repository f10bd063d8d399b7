#pragma once

// Tells on the bus with which options a process runs: OPTIONS_<process>, at its start and every
// 10 s, so that a logger that comes late has them. The agent_handler journals the newest.

#include <cstdint>
#include <string>

#include "bus/bus.h"

namespace pangea {

class OptionsAnnouncer {
 public:
  static constexpr int64_t kInterval_us = 10'000'000;

  // `yaml`: YamlOptions::PrintWithoutHelp.
  OptionsAnnouncer(Bus& bus, std::string process, std::string yaml)
      : bus_(bus), process_(std::move(process)), yaml_(std::move(yaml)) {}

  // Wall clock; the first call announces.
  void Tick(int64_t now_utime);

 private:
  Bus& bus_;
  const std::string process_;
  const std::string yaml_;
  int64_t started_utime_ = 0;
  int64_t next_utime_ = 0;
};

}  // namespace pangea
