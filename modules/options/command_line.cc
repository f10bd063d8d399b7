#include "options/command_line.h"

#include <fmt/format.h>

#include <cmath>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <iostream>
#include <stdexcept>
#include <system_error>

namespace pangea {
namespace {

CLI::Validator NumberThat(const std::function<bool(double)>& is_good, const std::string& words) {
  return {[=](std::string& text) -> std::string {
            double value = 0;
            const bool good =
                CLI::detail::lexical_cast(text, value) && std::isfinite(value) && is_good(value);
            return good ? "" : fmt::format("'{}' is no finite number {}", text, words);
          },
          words};
}

// "filesystem error: status: Permission denied [keys]" is no sentence for a user.
std::string TextOf(const std::exception& error) {
  const auto* const failed = dynamic_cast<const std::filesystem::filesystem_error*>(&error);
  if (failed == nullptr || failed->path1().empty()) {
    return error.what();
  }
  std::string paths = failed->path1().string();
  if (!failed->path2().empty()) {
    paths += ", " + failed->path2().string();
  }
  return fmt::format("{}: cannot be used: {}{}", paths, failed->code().message(),
                     failed->code() == std::errc::permission_denied
                         ? "; is it another user's? Get the right to it, or give another path"
                         : "");
}

}  // namespace

void AddVersion(CLI::App& app, const std::function<std::string()>& more) {
  app.set_version_flag("--version", [&app, more] {
    return app.get_name() + " " PANGEA_VERSION + (more ? "\n" + more() : "");
  });
}

int Failed(const std::string& program, const std::exception& error) {
  std::cerr << fmt::format("{}: {}\n", program, TextOf(error));
  return 1;
}

int RunSubcommand(CLI::App& app, int argc, char** argv) {
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error);
  } catch (const std::exception& error) {
    return Failed(app.get_name(), error);
  }
  return OutputIsWritten(app.get_name()) ? 0 : 1;
}

bool OutputIsWritten(const std::string& program) {
  if (std::cout.flush() && std::fflush(stdout) == 0 && std::ferror(stdout) == 0) {
    return true;
  }
  std::cerr << fmt::format("{}: the output cannot be written (disk full?)\n", program);
  return false;
}

CLI::Validator Positive() {
  return NumberThat([](double value) { return value > 0; }, "above 0");
}

CLI::Validator NotNegative() {
  return NumberThat([](double value) { return value >= 0; }, "0 or above");
}

CLI::Validator Within(double least, double most) {
  return NumberThat([=](double value) { return value >= least && value <= most; },
                    fmt::format("in [{:g} - {:g}]", least, most));
}

}  // namespace pangea
