#include "session/replay.h"

#include <fmt/format.h>

#include <algorithm>
#include <lcm/lcm-cpp.hpp>
#include <memory>
#include <stdexcept>

#include "common/bus/bus.h"
#include "fusion/fusion_process.h"
#include "global_ba/global_ba_process.h"
#include "inter_map_ba/inter_map_ba_process.h"
#include "place_recognition/place_recognition_process.h"
#include "posegraph/posegraph_process.h"
#include "session/keyframe_log.h"

namespace pangea::session {
namespace {

// Everything said on the bus, into an LCM log. Time stamps are those of the logs replayed, never
// the clock's.
class Recorder {
 public:
  Recorder(Bus& bus, const std::filesystem::path& log) : file_(log.string(), "w") {
    if (!file_.good()) {
      throw std::runtime_error(fmt::format("cannot write {}", log.string()));
    }
    bus.Subscribe(".*", [this](const std::string& channel, Bytes data) { Write(channel, data); });
  }

  // Events never share a stamp, so that tools which sort by it keep their order.
  void SetTime(int64_t utime) { utime_ = std::max(utime, utime_); }

 private:
  void Write(const std::string& channel, Bytes data) {
    lcm::LogEvent event{};
    event.timestamp = utime_++;
    event.channel = channel;
    event.datalen = static_cast<int32_t>(data.size());
    event.data = const_cast<uint8_t*>(data.data());
    if (file_.writeEvent(&event) != 0) {
      throw std::runtime_error("cannot write the replay's log: is the disk full?");
    }
  }

  lcm::LogFile file_;
  int64_t utime_ = 0;
};

}  // namespace

ReplaySummary Replay(const std::vector<std::filesystem::path>& logs,
                     const std::filesystem::path& out_log) {
  std::vector<std::vector<LoggedKeyframe>> keyframes;
  for (const std::filesystem::path& log : logs) {
    keyframes.push_back(ReadKeyframeLog(log));
  }

  LocalBus bus;
  Recorder recorder(bus, out_log);
  PlaceRecognitionProcess place_recognition(bus, PlaceRecognitionOptions{});
  InterMapBaProcess inter_map_ba(bus, InterMapBaOptions{});
  FusionProcess fusion(bus, FusionOptions{});
  PoseGraphProcess posegraph(bus, PoseGraphOptions{});
  GlobalBaProcess global_ba(bus, GlobalBaOptions{});

  const LoggedKeyframe& first = keyframes.front().front();
  const int64_t begin_utime = first.captured_utime - first.elapsed_us;
  ReplaySummary summary;
  for (const LoggedKeyframe& keyframe : Interleave(std::move(keyframes))) {
    recorder.SetTime(begin_utime + keyframe.elapsed_us);
    bus.Publish(keyframe.channel, keyframe.data);
    bus.Drain();
    ++summary.keyframes;
    const int32_t agent_id = keyframe.id.map.agent_id;
    if (std::find(summary.agent_ids.begin(), summary.agent_ids.end(), agent_id) ==
        summary.agent_ids.end()) {
      summary.agent_ids.push_back(agent_id);
    }
  }
  posegraph.Finish();
  bus.Drain();
  global_ba.Finish();
  bus.Drain();
  return summary;
}

}  // namespace pangea::session
