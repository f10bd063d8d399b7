#pragma once

// Runs the built programs like a user, and reads their output.

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

namespace pangea::tests {

// The session of two agents that comes with the sources.
inline const std::string kSample = PANGEA_SOURCE_DIR "/logs/two_walks/session.lcm";

struct Outcome {
  int exit_code = 0;
  std::string output;  // stdout and stderr
};

// Runs a shell command with the build's bin folder first on PATH.
Outcome RunCommand(const std::string& command);

// An empty folder for one test.
std::filesystem::path FreshFolder(const std::string& name);
std::string ReadFile(const std::filesystem::path& path);
nlohmann::json ReadJson(const std::filesystem::path& path);

// Root mean square distance, metres, between the keyframes of two TUM files in the same frame;
// infinite if the first does not exist, or if the keyframes are not the same.
double Distance_m(const std::filesystem::path& got, const std::filesystem::path& expected);
// What rounding by a compiler may cause after thousands of optimisation steps, metres.
inline constexpr double kTolerance_m = 0.005;

// The recording walk_1 or walk_2: walks of 14 s through one hall, at half the image size, rendered
// by ctest (the fixture `walks` in CMakeLists.txt).
std::filesystem::path Walk(int walk);

// Writes a session file with agents 1, 2, ... and these recordings; returns its path.
std::filesystem::path WriteSession(const std::filesystem::path& folder,
                                   const std::vector<std::string>& agents);

}  // namespace pangea::tests
