#include "bus/process_main.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <iostream>

#include "bus/retransmission/journal_first.h"
#include "bus/status_log.h"

namespace pangea {

int ProcessMain(int argc, char** argv, const ProcessDescription& description,
                const ProcessFactory& factory) {
  CLI::App app(description.summary, description.name);
  std::string url = kDefaultBusUrl;
  std::string options_file;
  bool print_options = false;
  app.add_option("--bus", url, "LCM URL of the server bus")->capture_default_str();
  if (description.options != nullptr) {
    app.add_option("--options", options_file, "YAML file with options");
    app.add_flag("--print-options", print_options, "print the default options and exit");
  }
  CLI11_PARSE(app, argc, argv);
  if (print_options) {
    std::cout << description.options->Print();
    return 0;
  }
  try {
    if (!options_file.empty()) {
      description.options->ReadFile(options_file);
    }
    UseOneThread();
    LcmBus bus(url);
    JournalFirstBus journal_first(bus, WallUtime());
    const std::unique_ptr<Process> process = factory(journal_first);
    StartLog(description.name,
             fmt::format("bus {}, options {}", url,
                         options_file.empty() ? "as compiled in" : "of " + options_file));
    return RunProcess(bus, *process, &journal_first);
  } catch (const std::exception& error) {
    std::cerr << fmt::format("{}: {}\n", description.name, error.what());
    return 1;
  }
}

}  // namespace pangea
