#include "server_process/process_main.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>

#include "blas/blas.h"
#include "bus/options_announcer.h"
#include "bus/status_log.h"
#include "journal_follower/journal_first.h"
#include "journal_follower/journal_reader.h"
#include "messages/channels.h"
#include "options/command_line.h"
#include "options/options_arguments.h"

namespace pangea {
namespace {

// For example, the program "pangea-global-ba" is "global_ba" on the bus.
std::string NameOnTheBus(const std::string& program) {
  std::string name = program.substr(std::string("pangea-").size());
  std::ranges::replace(name, '-', '_');
  return name;
}

void AddScratchOption(CLI::App& app, ScratchFileOptions* scratch) {
  constexpr int64_t kMega = 1'000'000;
  const auto set = [scratch](int64_t megabytes) { scratch->max_bytes = megabytes * kMega; };
  app.add_option_function<int64_t>("--scratch-mb", set,
                                   "of the file for keyframes, in $TMPDIR or else /var/tmp; what "
                                   "comes beyond stays in memory")
      ->check(CLI::Range(int64_t{0}, int64_t{1'000'000'000}))
      ->default_str(fmt::format("{}", scratch->max_bytes / kMega));
}

void AddCheckpointOptions(CLI::App& app, CheckpointPlace* checkpoint, std::string* journal) {
  CLI::Option* file =
      app.add_option("--checkpoint", checkpoint->file,
                     "what was made of the journal, so that a start reads only the rest of it");
  app.add_option("--write-checkpoint", *journal,
                 "the journal's file: reads it, brings the checkpoint up to it, and ends")
      ->needs(file);
}

// Lets the process read the journal's file and write its checkpoint, without a bus.
void WriteCheckpoint(const CheckpointPlace& checkpoint, const std::string& journal,
                     const ProcessFactory& factory) {
  JournalState known;
  try {
    known = CheckpointReader(checkpoint.file).head().journal;
  } catch (const std::runtime_error&) {
    // Without a usable checkpoint all of the journal is read.
  }
  LocalBus bus;
  const auto process = factory(bus);
  PublishMessage(bus, std::string(channels::kJournalFile),
                 ToMessage(JournalFile{std::filesystem::absolute(journal).string(),
                                       ReadJournalState(journal, known)}));
  bus.Drain();
}

// Adds the announcement of its options to a process.
class WithOptions : public Process {
 public:
  WithOptions(std::unique_ptr<Process> process, OptionsAnnouncer announcer)
      : process_(std::move(process)), announcer_(std::move(announcer)) {}

  void Tick(int64_t now_utime) override {
    announcer_.Tick(now_utime);
    process_->Tick(now_utime);
  }
  void BetweenMessages(int64_t now_utime) override { process_->BetweenMessages(now_utime); }
  int longest_wait_ms() const override { return process_->longest_wait_ms(); }

 private:
  std::unique_ptr<Process> process_;
  OptionsAnnouncer announcer_;
};

}  // namespace

int ProcessMain(int argc, char** argv, const ProcessDescription& description,
                const ProcessFactory& factory) {
  CLI::App app(description.summary, description.name);
  AddVersion(app, [] { return ToString(LoadedBlas()); });
  std::string url = kDefaultBusUrl;
  app.add_option("--bus", url, "LCM URL of the server bus")->capture_default_str();
  if (description.add_arguments) {
    description.add_arguments(app);
  }
  if (description.scratch != nullptr) {
    AddScratchOption(app, description.scratch);
  }
  std::string journal;
  if (description.checkpoint != nullptr) {
    AddCheckpointOptions(app, description.checkpoint, &journal);
  }
  OptionsArguments options(app);
  CLI11_PARSE(app, argc, argv);
  try {
    options.Read(&description.options);
    if (options.Printed(description.options)) {
      return 0;
    }
    UseOneThread();  // OpenCV too uses a BLAS
    if (description.checkpoint != nullptr) {
      description.checkpoint->options = description.options.PrintWithoutHelp();
      description.checkpoint->writes = !journal.empty();
    }
    if (!journal.empty()) {
      StartLog(description.name, fmt::format("writes {}", description.checkpoint->file.string()));
      WriteCheckpoint(*description.checkpoint, journal, factory);
      return 0;
    }
    LcmBus bus(url);
    JournalFirstBus journal_first(bus, WallUtime());
    WithOptions process(factory(journal_first),
                        OptionsAnnouncer(bus, NameOnTheBus(description.name),
                                         description.options.PrintWithoutHelp()));
    StartLog(description.name, fmt::format("bus {}, {}", url, options.Source()));
    Log(description.name, ToString(LoadedBlas()));
    return RunProcess(bus, process, [&](int64_t now) { journal_first.Poll(now); });
  } catch (const std::exception& error) {
    return Failed(description.name, error);
  }
}

}  // namespace pangea
