#pragma once

// main() of a server process: command line, options, bus, messages until a signal.

#include <functional>
#include <memory>
#include <string>
#include <type_traits>

#include "bus/process.h"
#include "bus/retransmission/journal_follower.h"
#include "files/scratch_file.h"
#include "options/yaml_options.h"

namespace CLI {
class App;
}

namespace pangea {

struct ProcessDescription {
  std::string name;                       // "pangea-fusion"; on the bus it is "fusion"
  std::string summary;                    // for --help
  YamlOptions& options;                   // of --options FILE.yaml
  ScratchFileOptions* scratch = nullptr;  // of --scratch-mb; null: it sets nothing aside
  CheckpointPlace* checkpoint = nullptr;  // of --checkpoint; null: it keeps none
  std::function<void(CLI::App&)> add_arguments = {};  // of this program alone
};

// Reads the command line (--bus URL, --options FILE.yaml, --print-options, --scratch-mb), then
// makes the process, whose options are set by now, and runs it: the journal's HAVE first
// (journal_first.h), messages and ticks until a signal. It tells its options on the bus
// (options_announcer.h). With --write-checkpoint it reads the journal, writes the checkpoint and
// ends. Errors become one line and exit code 1.
using ProcessFactory = std::function<std::unique_ptr<Process>(Bus& bus)>;
int ProcessMain(int argc, char** argv, const ProcessDescription& description,
                const ProcessFactory& factory);

// Of a process that lets one choose nothing.
struct NoOptions {
  template <typename Archive>
  void Visit(Archive& /*archive*/) {}
};

// The main() of a process that keeps keyframes in a scratch file, has a checkpoint and no arguments
// of its own.
template <typename ServerProcess, typename Options = NoOptions>
int ServerProcessMain(int argc, char** argv, const std::string& name, const std::string& summary) {
  Options options;
  ScratchFileOptions scratch;
  CheckpointPlace checkpoint;
  YamlOptions yaml;
  options.Visit(yaml);
  return ProcessMain(argc, argv, {name, summary, yaml, &scratch, &checkpoint}, [&](Bus& bus) {
    const auto records = std::make_shared<ScratchFile>(scratch);
    if constexpr (std::is_same_v<Options, NoOptions>) {
      return std::make_unique<ServerProcess>(bus, records, checkpoint);
    } else {
      return std::make_unique<ServerProcess>(bus, options, records, checkpoint);
    }
  });
}

}  // namespace pangea
