#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace pangea {

// Parses the command line, which runs its subcommand (a callback of CLI11). What that throws
// becomes one line on stderr, behind the program's name. The exit code: 0, 1, or CLI11's (above
// 100).
int RunSubcommand(CLI::App& app, int argc, char** argv);

// Whether all that was printed is written, as a full disk does not let it; else a line on stderr,
// behind the program's name.
bool OutputIsWritten(const std::string& program);

// Throws std::runtime_error where two options name one LCM URL: what is relayed would come back.
void RequireTwoUrls(const std::string& option, const std::string& url,
                    const std::string& other_option, const std::string& other_url);

// For an option's check(): finite, and above 0; or not below. CLI11's own let nan pass.
CLI::Validator Positive();
CLI::Validator NotNegative();

}  // namespace pangea
