#pragma once

// --options FILE and --print-options of a program.

#include <CLI/CLI.hpp>
#include <string>

#include "options/yaml_options.h"

namespace pangea {

class OptionsArguments {
 public:
  // Must outlive the parsing of the command line.
  explicit OptionsArguments(CLI::App& app);

  // The file, if one was given. Throws std::runtime_error.
  void Read(YamlOptions* yaml) const;
  // Whether the options were to be printed, and are: then the program has done its work.
  bool Printed(const YamlOptions& yaml) const;
  // Where they are from, for people: "options as compiled in".
  std::string Source() const;

 private:
  std::string file_;
  bool print_ = false;
};

}  // namespace pangea
