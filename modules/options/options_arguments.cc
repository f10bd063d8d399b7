#include "options/options_arguments.h"

#include <iostream>

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
    std::cout << (text.find_first_not_of('\n') == std::string::npos ? "# no options\n" : text);
  }
  return print_;
}

std::string OptionsArguments::Source() const {
  return file_.empty() ? "options as compiled in" : "options of " + file_;
}

}  // namespace pangea
