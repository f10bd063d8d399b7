#include "replay/command_line.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <iostream>

#include "options/command_line.h"
#include "replay/keyframe_player.h"

namespace pangea::replay {

int RunCommandLine(int argc, char** argv) {
  CLI::App app("Plays stored keyframes onto an agent's bus, in place of an odometry",
               "pangea-keyframe-player");
  AddVersion(app);
  KeyframePlayerOptions options;
  std::string bus_url = kDefaultBusUrl;
  std::string log, rate = "1";
  app.add_option("--agent", options.agent_id, "agent id, as in the keyframes")
      ->required()
      ->check(CLI::Range(1, 65535));
  app.add_option("--keyframes", log,
                 "LCM log with KEYFRAME_k: of pangea-vio --out-keyframes, or of an earlier session")
      ->required()
      ->check(CLI::ExistingFile);
  app.add_option("--bus", bus_url, "LCM URL of the agent's bus")->capture_default_str();
  app.add_option("--rate", rate,
                 "1 = as recorded, but no pause above 10 s; 2 = twice as fast, max = as the server "
                 "keeps up")
      ->check(pangea::Within(1e-3, 1e6) | CLI::IsMember({"max"}))
      ->capture_default_str();
  app.add_option("--duration", options.duration_s, "seconds to play (default: to the end)")
      ->check(Positive());
  app.footer(
      "Exit code: 0; 1 when it failed; 3 when something of the log is lost (it is damaged, or "
      "ends in the middle of an event): then what could be read was played.");
  CLI11_PARSE(app, argc, argv);
  LogReadings readings;
  try {
    options.rate = rate == "max" ? 0 : std::stod(rate);
    InstallSignalHandlers();
    LcmBus bus(bus_url);
    auto keyframes = ReadKeyframeLogOf(log, options.agent_id, &readings);
    const int exit_code = TellLosses("pangea-keyframe-player", readings, 0);
    PlayKeyframes(bus, options, std::move(keyframes));
    return exit_code;
  } catch (const std::exception& error) {
    return TellLosses("pangea-keyframe-player", readings, Failed("pangea-keyframe-player", error));
  }
}

}  // namespace pangea::replay
