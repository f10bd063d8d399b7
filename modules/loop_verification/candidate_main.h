#pragma once

// The main() of inter_map_ba and fusion.

#include <CLI/CLI.hpp>
#include <memory>
#include <stdexcept>
#include <string>

#include "files/scratch_file.h"
#include "loop_verification/loop_verifier.h"
#include "server_process/process_main.h"
#include "tags/tag_file.h"

namespace pangea {

// Adds --tags FILE, which sets the sizes of tags.
inline void AddTagFile(CLI::App& app, LoopVerificationOptions* options) {
  const auto refused = [](const std::string& file) -> std::string {
    try {
      ReadTagFile(file);
      return "";
    } catch (const std::runtime_error& error) {
      return error.what();
    }
  };
  app.add_option_function<std::string>(
         "--tags", [options](const std::string& file) { options->tags = ReadTagFile(file); },
         "a site's tags.yaml, with their sizes")
      ->check(CLI::Validator(refused, "FILE"));
}

// `Verifier`: the subclass of CandidateProcess. `uses_tags`: it verifies candidates by tags.
template <typename Verifier>
int CandidateMain(int argc, char** argv, const std::string& name, const std::string& summary,
                  bool uses_tags) {
  LoopVerifierOptions options;
  ScratchFileOptions scratch;
  CheckpointPlace checkpoint;
  int threads = 1;
  YamlOptions yaml;
  options.Visit(yaml);
  const auto add_arguments = [&](CLI::App& app) {
    if (uses_tags) {
      AddTagFile(app, &options.alignment);
    }
    app.add_option("--threads", threads, "that verify; the results do not depend on it")
        ->check(CLI::Range(1, 64))
        ->capture_default_str();
  };
  return ProcessMain(
      argc, argv, {name, summary, yaml, &scratch, &checkpoint, add_arguments}, [&](Bus& bus) {
        return std::make_unique<Verifier>(bus, options, std::make_shared<ScratchFile>(scratch),
                                          checkpoint, threads);
      });
}

}  // namespace pangea
