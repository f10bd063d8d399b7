// pangea-own-odometry-example: a recording's images, and poses of any odometry ─► KEYFRAME_k

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <iostream>
#include <optional>

#include "bus/process.h"
#include "bus/retransmission/playback_pace.h"
#include "external_odometry/external_odometry_process.h"
#include "log_file/log_writer.h"
#include "messages/channels.h"
#include "messages/encoding.h"
#include "messages/messages.h"
#include "options/command_line.h"
#include "recording/euroc.h"
#include "recording/trajectory.h"

namespace pangea::example {
namespace {

struct Arguments {
  int32_t agent_id = 0;
  std::string recording, poses, bus, out_keyframes;
};

struct Counts {
  int poses = 0, maps = 0, keyframes = 0;
  int without_points = 0;  // of the keyframes
};

// Plays as fast as the server keeps up. A live odometry calls AddImage from its camera's callback
// instead.
Counts Play(const Arguments& arguments, const EurocRecording& recording, const Trajectory& poses) {
  LocalBus nobody;
  std::optional<LcmBus> bus;
  if (!arguments.bus.empty()) {
    bus.emplace(arguments.bus);
  }
  Counts counts;
  const auto open_map = [&counts] {
    ++counts.maps;
    return WallUtime();
  };
  ExternalOdometryProcess process(bus ? static_cast<Bus&>(*bus) : nobody, arguments.agent_id,
                                  recording.camera(), open_map, WallUtime());
  std::optional<PlaybackPace> pace;
  if (bus) {
    pace.emplace(&*bus, process, process.publisher());
  }
  std::optional<LogFileWriter> log;  // for `keyframes:` in a session file, and for a replay
  if (!arguments.out_keyframes.empty()) {
    log.emplace(arguments.out_keyframes);
  }
  for (size_t i = 0; i < recording.images().size() && !StopRequested(); ++i) {
    const int64_t utime = recording.images()[i].utime;
    const auto T_odom_body = Interpolate(poses, utime, ExternalOdometryProcess::kMaxLost_us);
    if (!T_odom_body) {  // the odometry is lost; if it stays so, its next pose begins a new map
      process.AddImage(utime, cv::Mat(), std::nullopt);
      nobody.Drain();
      continue;
    }
    ++counts.poses;
    std::string why;
    const cv::Mat image = recording.LoadImage(i, &why);
    if (image.empty()) {
      std::cerr << fmt::format("warning: {}\n", why);
      continue;
    }
    if (const auto keyframe = process.AddImage(utime, image, T_odom_body)) {
      ++counts.keyframes;
      counts.without_points += keyframe->points.empty() ? 1 : 0;
      if (log) {
        log->Write(utime, channels::Keyframe(arguments.agent_id),
                   EncodeMessage(ToMessage(*keyframe)));
      }
      if (pace) {
        pace->WaitForAcknowledgements();
      }
    }
    nobody.Drain();
  }
  if (pace) {
    pace->WaitAtTheEnd();
  }
  if (const int64_t missing = bus ? process.publisher().Unacknowledged() : 0; missing > 0) {
    throw std::runtime_error(
        fmt::format("{} of {} keyframes were not acknowledged: does pangea-uplink run on {}?",
                    missing, counts.keyframes, arguments.bus));
  }
  return counts;
}

// Poses of other units, axes or times still make an agent, but one that never fuses.
void Tell(const Counts& counts, const Arguments& arguments, const EurocRecording& recording) {
  if (counts.poses == 0) {
    throw std::runtime_error(fmt::format(
        "--poses {}: none lies within {:g} s of an image of {}; their times must be "
        "the images', in seconds (TUM) or nanoseconds (EuRoC)",
        arguments.poses, 1e-6 * ExternalOdometryProcess::kMaxLost_us, arguments.recording));
  }
  if (counts.keyframes == 0) {
    throw std::runtime_error(
        fmt::format("--poses {}: no keyframe from {} poses in {} maps, as each jump begins a new "
                    "map; they must be in metres",
                    arguments.poses, counts.poses, counts.maps));
  }
  std::cout << fmt::format("agent {}: {} of {} images have a pose; {} keyframes in {} maps\n",
                           arguments.agent_id, counts.poses, recording.images().size(),
                           counts.keyframes, counts.maps);
  if (2 * counts.without_points > counts.keyframes) {
    std::cerr << fmt::format(
        "warning: {} of {} keyframes have no map points: are the poses T_odom_body, with the "
        "quaternion as x y z w, at the images' times?\n",
        counts.without_points, counts.keyframes);
  }
}

void Run(const Arguments& arguments) {
  const EurocRecording recording(arguments.recording);
  std::vector<std::string> warnings;
  const Trajectory poses = ReadTrajectory(arguments.poses, &warnings);
  for (const std::string& warning : warnings) {
    std::cerr << fmt::format("warning: {}\n", warning);
  }
  Tell(Play(arguments, recording, poses), arguments, recording);
}

}  // namespace
}  // namespace pangea::example

int main(int argc, char** argv) {
  CLI::App app("Makes an agent of any odometry: images and poses in, keyframes out",
               "pangea-own-odometry-example");
  pangea::AddVersion(app);
  pangea::example::Arguments arguments;
  app.add_option("--agent", arguments.agent_id, "agent id")
      ->required()
      ->check(CLI::Range(1, 65535));
  app.add_option("--recording", arguments.recording, "EuRoC folder with the images")->required();
  app.add_option("--poses", arguments.poses, "T_odom_body, z up: a TUM or EuRoC trajectory file")
      ->required()
      ->check(CLI::ExistingFile);
  app.add_option("--bus", arguments.bus, "LCM URL of the agent's bus (default: none)");
  app.add_option("--out-keyframes", arguments.out_keyframes, "write the keyframes as an LCM log");
  CLI11_PARSE(app, argc, argv);
  try {
    pangea::InstallSignalHandlers();
    pangea::example::Run(arguments);
    return 0;
  } catch (const std::exception& error) {
    return pangea::Failed("pangea-own-odometry-example", error);
  }
}
