#pragma once

// The loop around a process class: bus, ticks, status, signals. A server main.cc is
//   ProcessMain(argc, argv, {"fusion", "what it does"}, [](Bus& bus, const std::string&
//   options_file) { ... });

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "common/bus/bus.h"

namespace pangea {

// A process without its loop. Handlers run between Ticks, on one thread.
class Process {
 public:
  virtual ~Process() = default;
  // Housekeeping at about 10 Hz: resend requests, time-outs, status. Never called in a replay, so
  // no result may depend on it.
  virtual void Tick(int64_t now_utime) = 0;
};

// Wall clock, microseconds since 1970.
int64_t WallUtime();
// Monotonic clock, microseconds.
int64_t SteadyMicros();

// Set by SIGINT and SIGTERM once InstallSignalHandlers has run.
void InstallSignalHandlers();
bool StopRequested();

// What is solved is solved in the thread that asks for it. CHOLMOD would start three more, which
// OMP_NUM_THREADS does not keep it from: it asks OpenMP for four by number. Call it at the start.
void UseOneThread();

class JournalFirstBus;

// Handles messages and ticks until a signal. Returns the exit code.
int RunProcess(LcmBus& bus, Process& process, JournalFirstBus* journal_first = nullptr);

struct ProcessDescription {
  std::string name;                  // "pangea-fusion"
  std::string summary;               // for --help
  std::string default_options_yaml;  // printed by --print-options; empty if it has none
};

// A server process: command line (--bus URL, --options FILE.yaml, --print-options), then messages,
// the journal's HAVE first (journal_first.h), and ticks until a signal. Errors become one line and
// exit code 1.
using ProcessFactory =
    std::function<std::unique_ptr<Process>(Bus& bus, const std::string& options_file)>;
int ProcessMain(int argc, char** argv, const ProcessDescription& description,
                const ProcessFactory& factory);

}  // namespace pangea
