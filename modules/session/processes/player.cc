#include "session/processes/player.h"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

#include "bus/process.h"
#include "recording/euroc.h"

namespace pangea::session {

double Now() { return 1e-6 * static_cast<double>(WallUtime()); }

bool Player::IsOver() const {
  return script.live && script.duration_s > 0 && started_s > 0 &&
         Now() - started_s >= script.duration_s;
}

void CheckRecording(const AgentScript& script) {
  if (script.live || !script.keyframes.empty()) {
    return;  // the recording then only provides ground truth
  }
  try {
    const EurocRecording recording(script.resolved.string());
    const auto& images = recording.images();
    const double length_s = 1e-6 * static_cast<double>(images.back().utime - images.front().utime);
    if (script.start_s > length_s) {
      throw std::runtime_error(
          fmt::format("start: {:g} is beyond the end of {}, which is {:.1f} s long", script.start_s,
                      recording.mav0(), length_s));
    }
  } catch (const std::runtime_error& error) {
    throw std::runtime_error(fmt::format("agent {}: {}", script.id, error.what()));
  }
}

std::vector<std::string> InputOf(const Player& player, const std::string& rate) {
  const AgentScript& script = player.script;
  if (script.live) {
    return {"--live"};
  }
  const bool stored = !script.keyframes.empty();
  const double before_s = stored ? 0 : player.played_before_s;
  std::vector<std::string> arguments = {"--rate", rate};
  if (stored) {
    arguments.insert(arguments.end(), {"--keyframes", script.resolved_keyframes.string()});
  } else {
    arguments.insert(arguments.end(), {"--recording", script.resolved.string(), "--start",
                                       fmt::format("{}", script.start_s + before_s)});
  }
  if (script.duration_s > 0) {
    // Killed after its last image, it has nothing left to play, and --duration is above 0.
    const double rest_s = std::max(1e-3, script.duration_s - before_s);
    arguments.insert(arguments.end(), {"--duration", fmt::format("{}", rest_s)});
  }
  return arguments;
}

std::string DescribeLive(const AgentScript& script, const std::string& bus) {
  const std::string end =
      script.duration_s > 0 ? fmt::format("for {:g} s", script.duration_s) : "until Ctrl-C";
  return fmt::format("agent {0} is live {1}: it takes CAMERA_{0}, IMU_{0}, IMAGE_{0} on {2}",
                     script.id, end, bus);
}

}  // namespace pangea::session
