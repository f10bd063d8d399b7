#pragma once

// The arguments --options FILE and --print-options of a program.

#include <CLI/CLI.hpp>
#include <string>

#include "options/yaml_options.h"

namespace pangea {

class OptionsArguments {
 public:
  // Adds the arguments to `app`. This object must outlive the parsing of the command line.
  explicit OptionsArguments(CLI::App& app);

  // Reads the file into `yaml` if one was given. Throws std::runtime_error.
  void Read(YamlOptions* yaml) const;
  // If --print-options was given, prints the options and returns true: the program should then end.
  // Throws std::runtime_error if they cannot be printed.
  bool Printed(const YamlOptions& yaml) const;
  // Where the options come from, for people; for example "options as compiled in".
  std::string Source() const;

 private:
  std::string file_;
  bool print_ = false;
};

}  // namespace pangea
