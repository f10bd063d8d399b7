#pragma once

// Runs the built programs as a user would, and looks at what they leave.

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

// A shell command with the build's bin folder first on PATH.
Outcome RunCommand(const std::string& command);

// An empty folder for one test.
std::filesystem::path FreshFolder(const std::string& name);
std::string ReadFile(const std::filesystem::path& path);
nlohmann::json ReadJson(const std::filesystem::path& path);

// Root mean square of the distances between the keyframes of two TUM files in one frame; infinite
// when the first does not exist or they are not the same keyframes.
double Distance_m(const std::filesystem::path& got, const std::filesystem::path& expected);

// The recording walk_1 or walk_2: two walks of 14 s through one hall at half size, which ctest has
// rendered before (the fixture `walks` in CMakeLists.txt).
std::filesystem::path Walk(int walk);

// A session of agents 1, 2, ... with these recordings; returns the file.
std::filesystem::path WriteSession(const std::filesystem::path& folder,
                                   const std::vector<std::string>& agents);

}  // namespace pangea::tests
