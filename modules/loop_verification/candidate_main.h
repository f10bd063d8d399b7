#pragma once

// The main() of inter_map_ba and fusion.

#include <CLI/CLI.hpp>
#include <memory>
#include <string>

#include "files/scratch_file.h"
#include "loop_verification/loop_verifier.h"
#include "server_process/process_main.h"

namespace pangea {

// `Verifier`: the subclass of CandidateProcess.
template <typename Verifier>
int CandidateMain(int argc, char** argv, const std::string& name, const std::string& summary) {
  LoopVerifierOptions options;
  ScratchFileOptions scratch;
  CheckpointPlace checkpoint;
  int threads = 1;
  YamlOptions yaml;
  options.Visit(yaml);
  const auto add_arguments = [&threads](CLI::App& app) {
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
