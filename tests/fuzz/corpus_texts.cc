#include <string>
#include <utility>
#include <vector>

#include "corpus.h"
#include "files/text_file.h"
#include "global_ba/global_ba.h"
#include "link/agent_key.h"
#include "loop_verification/drift_gate.h"
#include "loop_verification/steps/steps.h"
#include "options/yaml_options.h"
#include "posegraph/posegraph.h"
#include "thinning/thinning.h"
#include "vio/vio_file_options.h"

namespace pangea::fuzz {
namespace {

namespace fs = std::filesystem;

template <typename Options>
std::string Printed() {
  Options options;
  YamlOptions yaml;
  options.Visit(yaml);
  return yaml.Print();
}

std::string KeyText() {
  const fs::path file = ScratchFolder() / "agent_1.key";
  fs::remove(file);
  MakeKeyFile(file, 1);
  return ReadTextFile(file);
}

// One seed for each kind of file, in the order of fuzz_options.cc.
void OptionFiles(const Corpus& corpus) {
  const std::string session =
      "agents:\n  - {id: 1, keyframes: a.lcm, delay: 1.5, duration: 60, link: {loss: 0.1, "
      "delay_ms: 50, partitions: [{at: 3, seconds: 4}], seed: 7}}\n"
      "  - {id: 2, recording: MH_01, start: 3}\n";
  const std::vector<std::pair<std::string, std::string>> seeds = {
      {"session", session},
      {"vio", Printed<vio::VioFileOptions>()},
      {"loop_verification", Printed<LoopVerificationOptions>()},
      {"posegraph", Printed<PoseGraphOptions>()},
      {"global_ba", Printed<GlobalBaOptions>()},
      {"thinning", Printed<ThinningOptions>()},
      {"key", KeyText()},
  };
  for (size_t i = 0; i < seeds.size(); ++i) {
    corpus.AddText("options", seeds[i].first,
                   std::string(1, static_cast<char>('F' + static_cast<int>(i))) + seeds[i].second);
  }
}

void AnchorApiRequests(const Corpus& corpus) {
  corpus.AddText("anchor_api", "group",
                 R"(POST /v1/anchors
{"name": "kettle", "payload": "{}", "pose": {"group": "1/1000", "position": [1, 2, 0.5],
 "orientation": [1, 0, 0, 0]}})");
  corpus.AddText("anchor_api", "keyframe",
                 R"(POST /v1/anchors
{"name": "door", "pose": {"keyframe": {"map": "2/1001", "seq": 1}, "position": [1, 0, 0]}})");
  corpus.AddText("anchor_api", "pixel",
                 R"(POST /v1/anchors
{"name": "tap", "pose": {"agent": 1, "utime": 1000000, "pixel": [376.5, 240]}})");
  corpus.AddText("anchor_api", "change",
                 "PUT /v1/anchors/1%2F17\n{\"name\": \"pot\", \"revision\": 1}");
  corpus.AddText("anchor_api", "delete", "DELETE /v1/anchors/1/17\n");
  corpus.AddText("anchor_api", "list", "GET /v1/anchors?group=1%2F1000\n");
  corpus.AddText("anchor_api", "agent", "GET /v1/agents/2/anchors\n");
}

void Recording(const Corpus& corpus) {
  const std::string extrinsics =
      "T_BS:\n  rows: 4\n  cols: 4\n  data: [1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1]\n";
  corpus.AddText(
      "recording", "whole",
      extrinsics +
          "resolution: [32, 24]\nintrinsics: [30, 31, 16, 12]\ndistortion_model: radtan\n"
          "distortion_coefficients: [0.1, 0.01, 0, 0]\nreadout_s: 0.02\n\f" +
          extrinsics +
          "rate_hz: 200\ngyroscope_noise_density: 1e-4\ngyroscope_random_walk: 2e-5\n"
          "accelerometer_noise_density: 3e-3\naccelerometer_random_walk: 4e-3\n\f"
          "#timestamp [ns],filename\n1000000000,1000000000.png\n\f"
          "#timestamp [ns],w,w,w,a,a,a\n999000000,0.1,0.2,0.3,0,0,9.81\n"
          "1004000000,0.1,0.2,0.3,0,0,9.81\n1010000000,0.1,0.2,0.3,0,0,9.81\n\f"
          "#t\n1000000000,1,2,3,1,0,0,0\n2000000000,1,2,4,1,0,0,0\n\f" +
          extrinsics);
  corpus.AddText("recording", "tum", "\f\f\f\f1.5 1 2 3 0 0 0 1\n2.5 1 2 4 0 0 0 1\n");
}

}  // namespace

void AddTexts(const Corpus& corpus) {
  OptionFiles(corpus);
  AnchorApiRequests(corpus);
  Recording(corpus);
}

}  // namespace pangea::fuzz
