#include "vio/command_line.h"

#include <fmt/format.h>
#ifdef __GLIBC__
#include <malloc.h>
#endif

#include <CLI/CLI.hpp>
#include <iostream>
#include <opencv2/core/utility.hpp>
#include <optional>
#include <string>

#include "bus/process.h"
#include "bus/status_log.h"
#include "options/command_line.h"
#include "options/options_arguments.h"
#include "recording/euroc.h"
#include "vio/live/live_input.h"
#include "vio/playback.h"
#include "vio/vio_file_options.h"
#include "vio/vio_process.h"

namespace pangea::vio {
namespace {

constexpr int kFewPoses = 2;  // exit code

struct Arguments {
  std::string bus = kDefaultBusUrl;
  std::string recording;
  bool live = false;
  std::string rate = "1";
  PlaybackOptions playback;
  VioProcessOptions process;
};

// `--bus none`: published messages are discarded.
class NoBus : public Bus {
 public:
  void Publish(const std::string&, Bytes) override {}
  void Subscribe(const std::string&, Handler) override {}
};

void AddArguments(CLI::App& app, Arguments& a) {
  app.add_option("--agent", a.process.agent_id, "agent id")->check(CLI::Range(1, 65535));
  app.add_option("--bus", a.bus, "LCM URL of the agent's bus, or none")->capture_default_str();
  app.add_option("--recording", a.recording,
                 "folder in EuRoC's format: plays it; MH_01 finds MH_01_easy");
  app.add_flag("--live", a.live, "images and samples from IMU_k, IMAGE_k, CAMERA_k");
  app.add_option("--start", a.playback.start_s, "seconds of the recording to skip")
      ->check(NotNegative());
  app.add_option("--duration", a.playback.duration_s, "seconds of the recording to play")
      ->check(Positive());
  app.add_option("--delay", a.playback.delay_s, "seconds to wait before the first image")
      ->check(NotNegative());
  app.add_option("--rate", a.rate, "1, 2, ... times real time, or max")->capture_default_str();
  app.add_option("--tracks", a.playback.tracks_csv,
                 "exact tracks (stamp_ns, landmark_id, u, v) instead of the tracker's");
  app.add_option("--map-utime", a.process.map_utime,
                 "opened_utime of the first map, instead of the wall clock");
  app.add_option("--out-tum", a.process.out_tum, "write the raw odometry, TUM");
  app.add_option("--out-keyframes", a.process.out_keyframes, "write the keyframes as an LCM log");
}

double ParseRate(const std::string& rate) {
  if (rate == "max") {
    return 0;
  }
  double value = 0;
  if (!CLI::detail::lexical_cast(rate, value) || !(value > 0)) {
    throw std::runtime_error(fmt::format("--rate {}: a number above 0, or max", rate));
  }
  return value;
}

// Prints the outcome and returns the exit code. Being stopped before the first pose is no failure.
int Outcome(const VioProcess& process) {
  const std::optional<std::string> why = process.WhyFewPoses();
  std::cerr << fmt::format("pangea-vio: {}\n", why ? *why : process.Totals());
  if (process.output_error()) {
    std::cerr << fmt::format("pangea-vio: {}\n", *process.output_error());
    return 1;
  }
  return why && !StopRequested() ? kFewPoses : 0;
}

int Run(const Arguments& a, const LiveImuNoise& live_imu, const std::string& options_source) {
  std::optional<EurocRecording> recording;
  if (!a.live) {
    const std::string folder = FindRecording(a.recording).value_or(a.recording).string();
    if (folder != a.recording) {
      std::cerr << fmt::format("pangea-vio: plays {}\n", folder);
    }
    recording.emplace(folder);
    for (const std::string& warning : recording->warnings()) {
      std::cerr << fmt::format("pangea-vio: {}\n", warning);
    }
  }
  NoBus no_bus;
  std::optional<LcmBus> lcm_bus;
  if (a.bus != "none") {
    lcm_bus.emplace(a.bus);
  }
  Bus& bus = lcm_bus ? static_cast<Bus&>(*lcm_bus) : no_bus;
  InstallSignalHandlers();
  VioProcess process(bus, a.process, WallUtime());
  if (recording) {
    process.Open(recording->camera(), recording->imu_noise(), recording->calibration_sigmas());
    Playback(lcm_bus ? &*lcm_bus : nullptr, process, *recording, a.playback).Run();
    return Outcome(process);
  }
  StartLog("pangea-vio",
           fmt::format("agent {}, live, bus {}, {}", a.process.agent_id, a.bus, options_source));
  LiveInput live(process, a.process.agent_id, live_imu);
  RunProcess(*lcm_bus, process);
  process.Flush();
  process.PublishFinished(WallUtime());
  return Outcome(process);
}

void Check(const Arguments& a) {
  if (a.process.agent_id == 0) {
    throw std::runtime_error("--agent ID is missing: 1 to 65535, unique in the session");
  }
  if (a.live == !a.recording.empty()) {
    throw std::runtime_error("either --recording DIR or --live is needed");
  }
  if (a.live && a.bus == "none") {
    throw std::runtime_error("--live needs a bus");
  }
}

// The images of a frame and of a keyframe's scale space are freed and allocated again each time. By
// default the C library returns such memory to the system, which clears every page when it is
// allocated again: this takes a tenth of the odometry's time.
void KeepFreedMemory() {
#ifdef __GLIBC__
  mallopt(M_MMAP_THRESHOLD, 16 << 20);  // bytes
  mallopt(M_TRIM_THRESHOLD, 32 << 20);
#endif
}

}  // namespace

int RunCommandLine(int argc, char** argv) {
  CLI::App app("Visual-inertial odometry of one agent", "pangea-vio");
  AddVersion(app);
  Arguments arguments;
  AddArguments(app, arguments);
  OptionsArguments options(app);
  app.footer(fmt::format(
      "Exit code: 0; 1 when something could not be done; {} when a recording was played to its end "
      "and fewer than half of its images have a pose, or the poses are doubtful.",
      kFewPoses));
  CLI11_PARSE(app, argc, argv);
  try {
    VioFileOptions file_options;
    YamlOptions yaml;
    file_options.Visit(yaml);
    options.Read(&yaml);
    if (options.Printed(yaml)) {
      return 0;
    }
    Check(arguments);
    arguments.playback.rate = ParseRate(arguments.rate);
    arguments.process.vio = file_options.vio;
    arguments.process.told_options = yaml.PrintWithoutHelp();
    // One thread: the agent shares its machine with other processes, and results are reproducible.
    cv::setNumThreads(1);
    KeepFreedMemory();
    return Run(arguments, file_options.live_imu, options.Source());
  } catch (const std::exception& error) {
    return Failed("pangea-vio", error);
  }
}

}  // namespace pangea::vio
