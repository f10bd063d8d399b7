// Runs the phone's agent as a native program and prints the time per image, as pangea-agent.mjs
// does, for comparison.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <ctime>
#include <vector>

#include "phone/agent/phone_agent.h"
#include "recording/euroc.h"

namespace pangea::phone {
namespace {

constexpr int64_t kAhead_us = 60'000;  // samples are added this far ahead: past an image's last row

double CpuMs() { return 1e3 * static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

AgentConfig ConfigOf(const EurocRecording& recording) {
  AgentConfig config;
  config.agent_id = 1;
  config.opened_utime = recording.images().front().utime;
  config.camera = recording.camera();
  config.sigmas = recording.calibration_sigmas();
  config.imu_noise = recording.imu_noise();
  return config;
}

void Play(const EurocRecording& recording, double seconds) {
  PhoneAgent agent(ConfigOf(recording));
  const int64_t end = recording.images().front().utime + static_cast<int64_t>(1e6 * seconds);
  std::vector<double> times_ms;
  size_t keyframes = 0, next = 0;
  for (size_t i = 0; i < recording.images().size() && recording.images()[i].utime <= end; ++i) {
    const int64_t utime = recording.images()[i].utime;
    std::string why;
    const cv::Mat image = recording.LoadImage(i, &why);
    for (; next < recording.imu().size() && recording.imu()[next].utime <= utime + kAhead_us;
         ++next) {
      agent.AddImu(recording.imu()[next]);
    }
    const double begin_ms = CpuMs();
    agent.AddImage(utime, image);
    keyframes += agent.Take().keyframes.size();
    times_ms.push_back(CpuMs() - begin_ms);
    agent.Poll(utime);
  }
  double sum_ms = 0;
  for (const double time_ms : times_ms) {
    sum_ms += time_ms;
  }
  std::ranges::sort(times_ms);
  const auto share = [&](double q) {
    return times_ms[static_cast<size_t>(q * static_cast<double>(times_ms.size() - 1))];
  };
  fmt::print(
      "{} images, {} keyframes; ms of CPU an image: median {:.2f}, 95 % {:.2f}, mean {:.2f}\n",
      times_ms.size(), keyframes, share(0.5), share(0.95),
      sum_ms / static_cast<double>(times_ms.size()));
}

}  // namespace
}  // namespace pangea::phone

int main(int argc, char** argv) {
  CLI::App app("What an image takes the phone's agent");
  std::string recording;
  double seconds = 30;
  app.add_option("recording", recording, "folder in EuRoC's format")->required();
  app.add_option("--duration", seconds, "seconds of it");
  CLI11_PARSE(app, argc, argv);
  pangea::phone::Play(pangea::EurocRecording(recording), seconds);
  return 0;
}
