#include "bench/recognition/input.h"

#include <fmt/format.h>

#include <filesystem>
#include <stdexcept>
#include <utility>

#include "messages/encoding.h"
#include "messages/messages.h"
#include "recording/euroc.h"
#include "replay/keyframe_log.h"

namespace pangea::bench {
namespace {

Trajectory ReadTruth(const std::string& path) {
  std::vector<std::string> warnings;
  Trajectory truth = std::filesystem::is_directory(path) ? ReadEurocGroundTruthOf(path, &warnings)
                                                         : ReadTrajectory(path, &warnings);
  if (truth.empty()) {
    throw std::runtime_error(fmt::format("{}: the recording has no ground truth", path));
  }
  return truth;
}

Keyframe Decode(const LoggedKeyframe& logged) {
  KeyframeMessage message;
  DecodeMessage(logged.data, &message);
  Parsed<Keyframe> parsed = Parse(message);
  if (!parsed.value) {
    throw std::runtime_error(fmt::format("{}: {}", ToString(logged.id), parsed.refused));
  }
  return std::move(*parsed.value);
}

}  // namespace

Input ReadInput(const std::vector<AgentInput>& agents) {
  Input input;
  std::vector<std::vector<LoggedKeyframe>> logs;
  for (const AgentInput& agent : agents) {
    logs.push_back(ReadKeyframeLogOf(agent.keyframes, agent.id));
    input.truth[agent.id] = ReadTruth(agent.reference);
  }
  for (const LoggedKeyframe& logged : Interleave(std::move(logs))) {
    input.keyframes.push_back(Decode(logged));
  }
  return input;
}

}  // namespace pangea::bench
