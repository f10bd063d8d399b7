#pragma once

#include <CLI/CLI.hpp>
#include <exception>
#include <functional>
#include <string>

namespace pangea {

// Adds --version, which prints "pangea-vio 0.2.0" and what `more` returns below it.
void AddVersion(CLI::App& app, const std::function<std::string()>& more = {});

// Writes the error as one line on stderr, after the program's name. One of a file or folder begins
// with its path, as those of files/text_file.h do. Returns 1, the exit code of the program.
int Failed(const std::string& program, const std::exception& error);

// Parses the command line and runs the subcommand (a callback of CLI11). An exception becomes one
// line on stderr, after the program's name. Returns the exit code: 0, 1, or that of CLI11 (above
// 100) for a wrong command line.
int RunSubcommand(CLI::App& app, int argc, char** argv);

// Flushes stdout. False, with a line on stderr, if not all output could be written (a full disk).
bool OutputIsWritten(const std::string& program);

// For an option's check(): a finite number that is > 0, >= 0, or in this range. CLI11's own
// validators accept NaN.
CLI::Validator Positive();
CLI::Validator NotNegative();
CLI::Validator Within(double least, double most);

}  // namespace pangea
