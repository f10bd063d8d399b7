#pragma once

// Publishes the options of a process on OPTIONS_<process>, at its start and every 10 s, so that a
// logger that starts late also has them. The agent_handler journals the newest ones.

#include <cstdint>
#include <string>

#include "bus/bus.h"

namespace pangea {

class OptionsAnnouncer {
 public:
  static constexpr int64_t kInterval_us = 10'000'000;

  // `yaml`: the result of YamlOptions::PrintWithoutHelp.
  OptionsAnnouncer(Bus& bus, std::string process, std::string yaml)
      : bus_(bus), process_(std::move(process)), yaml_(std::move(yaml)) {}

  // `now_utime`: wall clock. The first call publishes.
  void Tick(int64_t now_utime);

 private:
  Bus& bus_;
  const std::string process_;
  const std::string yaml_;
  int64_t started_utime_ = 0;
  int64_t next_utime_ = 0;
};

}  // namespace pangea
