#pragma once

// The options of pangea-sim.

#include <string>
#include <vector>

#include "sim/recording.h"

namespace CLI {
class App;
}

namespace pangea::sim {

class CommandLine {
 public:
  // Adds its options to `app`; both must exist until Run has returned.
  explicit CommandLine(CLI::App& app);
  // Throws std::runtime_error with a one-line message for the user.
  void Run();

 private:
  void AddPath(CLI::App& app);
  void AddScene(CLI::App& app);
  void AddSensors(CLI::App& app);
  void Apply();
  RecordingSummary Render() const;

  RecordingOptions options_;
  std::string generate_ = "walk";
  std::string scene_ = "hall";
  std::string camera_ = "euroc";
  double shrink_ = 1;
  double knot_spacing_s_ = 0;
  double exposure_ms_ = 3;
  bool no_cache_ = false;
};

}  // namespace pangea::sim
