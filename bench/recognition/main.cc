#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <tuple>

#include "bench/recognition/input.h"
#include "bench/recognition/report.h"
#include "files/text_file.h"

namespace pangea::bench {
namespace {

void Measure(const std::vector<AgentInput>& agents, const std::filesystem::path& out) {
  std::filesystem::create_directories(out);
  const Input input = ReadInput(agents);
  const Outcome outcome = RunStages(input.keyframes, input.truth);
  const std::string table = Table(outcome);
  WriteTextFile(out / "recognition.md", table);
  WriteTextFile(out / "places.csv", Csv(outcome));
  WriteCurves(outcome, out);
  fmt::print("{}", table);
}

}  // namespace
}  // namespace pangea::bench

// Keyframe logs, ground truth --> ReadInput --> RunStages --> table, curves, rows
int main(int argc, char** argv) {
  CLI::App app("Precision and recall of place recognition, stage by stage",
               "pangea-recognition-bench");
  std::vector<std::tuple<int32_t, std::string, std::string>> given;
  std::string out;
  app.add_option("--agent", given,
                 "ID KEYFRAMES REFERENCE: its id, an LCM log of its keyframes, and a recording's "
                 "folder or a trajectory file, all references in one frame; once for each agent")
      ->required();
  app.add_option("--out", out, "folder for recognition.md, places.csv and the curves")->required();
  CLI11_PARSE(app, argc, argv);
  try {
    std::vector<pangea::bench::AgentInput> agents;
    for (const auto& [id, keyframes, reference] : given) {
      agents.push_back({id, keyframes, reference});
    }
    pangea::bench::Measure(agents, out);
    return 0;
  } catch (const std::exception& error) {
    fmt::print(stderr, "pangea-recognition-bench: {}\n", error.what());
    return 1;
  }
}
