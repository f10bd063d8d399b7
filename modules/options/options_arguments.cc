#include "options/options_arguments.h"

#include <iostream>
#include <stdexcept>

namespace pangea {

OptionsArguments::OptionsArguments(CLI::App& app) {
  app.add_option("--options", file_, "YAML file with options");
  app.add_flag("--print-options", print_,
               "print the options in force, those of --options included, and exit");
}

void OptionsArguments::Read(YamlOptions* yaml) const {
  if (!file_.empty()) {
    yaml->ReadFile(file_);
  }
}

bool OptionsArguments::Printed(const YamlOptions& yaml) const {
  if (print_) {
    const std::string text = yaml.Print();
    const bool has_none = text.find_first_not_of('\n') == std::string::npos;
    if (!(std::cout << (has_none ? "# no options\n" : text) << std::flush)) {
      throw std::runtime_error("--print-options: the output cannot be written (disk full?)");
    }
  }
  return print_;
}

std::string OptionsArguments::Source() const {
  return file_.empty() ? "options as compiled in" : "options of " + file_;
}

}  // namespace pangea
