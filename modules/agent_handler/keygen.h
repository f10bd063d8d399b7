#pragma once

// `pangea-agent-handler keygen`: makes an agent's key.

#include <CLI/CLI.hpp>
#include <cstdint>
#include <string>

namespace pangea {

struct KeygenArguments {
  int32_t agent_id = 0;
  std::string file;  // empty: agent_ID.key in the current folder
  std::string anchors = "own";
};

// Adds the subcommand, which fills in the arguments when it is parsed.
CLI::App* AddKeygen(CLI::App& app, KeygenArguments* arguments);

// Returns the exit code; throws std::runtime_error if the file exists or cannot be written.
int Keygen(const KeygenArguments& arguments);

}  // namespace pangea
