#include "programs.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <limits>
#include <sstream>

#include "recording/trajectory.h"

namespace pangea::tests {

namespace fs = std::filesystem;

Outcome RunCommand(const std::string& command) {
  const std::string line =
      "PATH=" PANGEA_BINARY_DIR "/bin:$PATH; { " + command + "; } </dev/null 2>&1";
  Outcome outcome;
  FILE* pipe = popen(line.c_str(), "r");
  if (pipe == nullptr) {
    ADD_FAILURE() << "cannot start a shell";
    return outcome;
  }
  char buffer[4096];
  for (size_t n = 0; (n = fread(buffer, 1, sizeof(buffer), pipe)) > 0;) {
    outcome.output.append(buffer, n);
  }
  const int status = pclose(pipe);
  outcome.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  return outcome;
}

fs::path FreshFolder(const std::string& name) {
  fs::path folder = fs::path(testing::TempDir()) / ("pangea_tests_" + name);
  fs::remove_all(folder);
  fs::create_directories(folder);
  return folder;
}

std::string ReadFile(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

nlohmann::json ReadJson(const fs::path& path) {
  return nlohmann::json::parse(ReadFile(path), nullptr, false);
}

double Distance_m(const fs::path& got_file, const fs::path& expected_file) {
  if (!fs::exists(got_file)) {
    return std::numeric_limits<double>::infinity();
  }
  const Trajectory got = ReadTum(got_file.string(), nullptr);
  const Trajectory expected = ReadTum(expected_file.string(), nullptr);
  const auto same_time = [](const StampedPose& a, const StampedPose& b) {
    return a.utime == b.utime;
  };
  if (!std::equal(got.begin(), got.end(), expected.begin(), expected.end(), same_time)) {
    return std::numeric_limits<double>::infinity();
  }
  double sum = 0;
  for (size_t i = 0; i < got.size(); ++i) {
    sum += (got[i].T.t - expected[i].T.t).squaredNorm();
  }
  return std::sqrt(sum / static_cast<double>(expected.size()));
}

fs::path Walk(int walk) {
  fs::path folder = fs::path(PANGEA_BINARY_DIR) / "tests" / fmt::format("walk_{}", walk);
  EXPECT_TRUE(fs::exists(folder)) << folder << " is missing: ctest -R tests.walk renders it";
  return folder;
}

fs::path WriteSession(const fs::path& folder, const std::vector<std::string>& agents) {
  fs::path file = folder / "session.yaml";
  std::ofstream stream(file);
  stream << "agents:\n";
  for (const std::string& agent : agents) {
    stream << "  - {" << agent << "}\n";
  }
  return file;
}

}  // namespace pangea::tests
