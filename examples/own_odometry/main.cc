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

// Plays as fast as the server keeps up. A live odometry calls AddImage from its camera's callback
// instead.
void Play(const Arguments& arguments) {
  const EurocRecording recording(arguments.recording);
  std::vector<std::string> warnings;
  const Trajectory poses = ReadTrajectory(arguments.poses, &warnings);
  for (const std::string& warning : warnings) {
    std::cerr << fmt::format("warning: {}\n", warning);
  }
  LocalBus nobody;
  std::optional<LcmBus> bus;
  if (!arguments.bus.empty()) {
    bus.emplace(arguments.bus);
  }
  ExternalOdometryProcess process(bus ? static_cast<Bus&>(*bus) : nobody, arguments.agent_id,
                                  recording.camera(), WallUtime, WallUtime());
  std::optional<PlaybackPace> pace;
  if (bus) {
    pace.emplace(&*bus, process, process.publisher());
  }
  std::optional<LogFileWriter> log;  // for `keyframes:` in a session file, and for a replay
  if (!arguments.out_keyframes.empty()) {
    log.emplace(arguments.out_keyframes);
  }
  int keyframes = 0;
  for (size_t i = 0; i < recording.images().size() && !StopRequested(); ++i) {
    constexpr int64_t kMaxGap_us = 200'000;
    const int64_t utime = recording.images()[i].utime;
    const auto T_odom_body = Interpolate(poses, utime, kMaxGap_us);
    if (!T_odom_body) {  // the odometry is lost; if it stays so, its next pose begins a new map
      process.AddImage(utime, cv::Mat(), std::nullopt);
      nobody.Drain();
      continue;
    }
    std::string why;
    const cv::Mat image = recording.LoadImage(i, &why);
    if (image.empty()) {
      std::cerr << fmt::format("warning: {}\n", why);
      continue;
    }
    if (const auto keyframe = process.AddImage(utime, image, T_odom_body)) {
      ++keyframes;
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
  if (keyframes == 0) {
    throw std::runtime_error(
        fmt::format("--poses {}: none lies within 0.2 s of an image of {}; their times must be "
                    "the images', in seconds (TUM) or nanoseconds (EuRoC)",
                    arguments.poses, arguments.recording));
  }
  std::cout << fmt::format("agent {}: {} keyframes\n", arguments.agent_id, keyframes);
}

}  // namespace
}  // namespace pangea::example

int main(int argc, char** argv) {
  CLI::App app("Makes an agent of any odometry: images and poses in, keyframes out",
               "pangea-own-odometry-example");
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
    pangea::example::Play(arguments);
    return 0;
  } catch (const std::exception& error) {
    return pangea::Failed("pangea-own-odometry-example", error);
  }
}
