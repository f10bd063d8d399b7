#include "options/command_line.h"

#include <fmt/format.h>

#include <exception>
#include <iostream>

namespace pangea {

int RunSubcommand(CLI::App& app, int argc, char** argv) {
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error);
  } catch (const std::exception& error) {
    std::cerr << fmt::format("{}: {}\n", app.get_name(), error.what());
    return 1;
  }
  return 0;
}

}  // namespace pangea
