#pragma once

// The main() of a server process: it reads command line and options, opens the bus, and handles
// messages until a signal.

#include <functional>
#include <memory>
#include <string>
#include <type_traits>

#include "bus/process.h"
#include "files/scratch_file.h"
#include "journal_follower/journal_follower.h"
#include "options/yaml_options.h"

namespace CLI {
class App;
}

namespace pangea {

struct ProcessDescription {
  std::string name;                       // "pangea-fusion"; its name on the bus is "fusion"
  std::string summary;                    // for --help
  YamlOptions& options;                   // set by --options FILE.yaml
  ScratchFileOptions* scratch = nullptr;  // set by --scratch-mb; null: no scratch file
  CheckpointPlace* checkpoint = nullptr;  // set by --checkpoint; null: no checkpoints
  std::function<void(CLI::App&)> add_arguments = {};  // adds arguments of this program
};

// Reads the command line into `description`, then lets `factory` make the process and runs it until
// a signal. The process hears of the journal before all else (journal_first.h); its options are
// published (options_announcer.h). With --write-checkpoint, it only reads the journal and writes
// the checkpoint. An exception becomes one line on stderr and exit code 1. Returns the exit code.
using ProcessFactory = std::function<std::unique_ptr<Process>(Bus& bus)>;
int ProcessMain(int argc, char** argv, const ProcessDescription& description,
                const ProcessFactory& factory);

// The options of a process that has none.
struct NoOptions {
  template <typename Archive>
  void Visit(Archive& /*archive*/) {}
};

// The main() of a process that has a scratch file for keyframes and a checkpoint, and no arguments
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
