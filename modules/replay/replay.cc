#include "replay/replay.h"

#include <fmt/format.h>

#include <algorithm>
#include <lcm/lcm-cpp.hpp>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <stdexcept>

#include "anchors/anchors_process.h"
#include "bus/bus.h"
#include "files/scratch_file.h"
#include "fusion/fusion_process.h"
#include "global_ba/global_ba_process.h"
#include "inter_map_ba/inter_map_ba_process.h"
#include "log_file/log_reader.h"
#include "log_file/log_writer.h"
#include "messages/channels.h"
#include "pangea/again_t.hpp"
#include "pangea/options_t.hpp"
#include "place_recognition/place_recognition_process.h"
#include "posegraph/posegraph_process.h"
#include "replay/keyframe_log.h"
#include "replay/logged_edits.h"

namespace pangea {
namespace {

namespace fs = std::filesystem;

// Writes all messages on the bus into an LCM log. Time stamps are those of the replayed logs, never
// the wall clock.
class Recorder {
 public:
  Recorder(Bus& bus, const ServerOptions& options, const fs::path& log)
      : options_(options), log_(log.string()) {
    bus.Subscribe(".*", [this](const std::string& channel, Bytes data) {
      log_.Write(utime_++, channel, data);
    });
  }

  // Events have distinct stamps, so that tools which sort by stamp keep their order. Only the
  // options share the stamp of the first event, which therefore has the same stamp as without
  // options.
  void SetTime(int64_t utime) {
    if (utime_ == 0) {
      WriteOptions(utime);
    }
    utime_ = std::max(utime, utime_);
  }

 private:
  void WriteOptions(int64_t utime) {
    for (const auto& [process, text] : TextsByProcess(options_)) {
      options_t message{};
      message.process = process;
      message.utime = utime;
      message.yaml = text;
      log_.Write(utime, channels::Options(process), EncodeMessage(message));
    }
  }

  const ServerOptions options_;
  LogFileWriter log_;
  int64_t utime_ = 0;
};

// All or some of the server's processes.
class Server {
 public:
  Server(LocalBus& bus, const ServerOptions& options, const std::set<std::string>& processes)
      : bus_(bus) {
    const auto wanted = [&processes](const char* process) { return processes.contains(process); };
    const auto scratch = std::make_shared<ScratchFile>();
    if (wanted("place_recognition")) {
      place_recognition_.emplace(bus, options.place_recognition, scratch);
    }
    if (wanted("inter_map_ba")) {
      inter_map_ba_.emplace(bus, options.inter_map_ba, scratch);
    }
    if (wanted("fusion")) {
      fusion_.emplace(bus, options.fusion, scratch);
    }
    if (wanted("posegraph")) {
      posegraph_.emplace(bus, options.posegraph);
    }
    if (wanted("global_ba")) {
      global_ba_.emplace(bus, options.global_ba, scratch);
    }
    if (wanted("anchors")) {
      anchors_.emplace(bus, options.anchors, scratch);
    }
  }

  // Does the work that a live process does when the bus is quiet.
  void Finish() {
    if (posegraph_) {
      posegraph_->Finish();
      bus_.Drain();
    }
    while (global_ba_ && global_ba_->HasWork()) {
      global_ba_->Finish();
      bus_.Drain();
    }
    if (anchors_) {
      anchors_->Finish();
      bus_.Drain();
    }
  }

 private:
  LocalBus& bus_;
  std::optional<PlaceRecognitionProcess> place_recognition_;
  std::optional<InterMapBaProcess> inter_map_ba_;
  std::optional<FusionProcess> fusion_;
  std::optional<PoseGraphProcess> posegraph_;
  std::optional<GlobalBaProcess> global_ba_;
  std::optional<AnchorsProcess> anchors_;
};

void DropLater(double until_s, std::vector<LoggedKeyframe>* keyframes) {
  std::erase_if(*keyframes, [until_s](const LoggedKeyframe& keyframe) {
    return 1e-6 * static_cast<double>(keyframe.elapsed_us) > until_s;
  });
  if (keyframes->empty()) {
    throw std::runtime_error(fmt::format("--until {:g}: no keyframe had come by then", until_s));
  }
}

// A message of the log, for a replay of some processes.
struct LoggedMessage {
  int64_t utime = 0;
  double elapsed_s = 0;  // since the log's first event
  std::string channel;
  std::vector<uint8_t> data;
  bool own = false;  // sent by one of the replayed processes
};

bool IsKeyframe(const std::string& channel) {
  return channel.starts_with(channels::kKeyframePrefix);
}

// Whether the channel carries messages of agents, which no server process computes.
bool IsFromAgents(const std::string& channel) {
  return IsKeyframe(channel) || channel == channels::kAnchorEdit;
}

// Whether the channel is that of matches or verification results.
bool IsMatchOrResult(const std::string& channel) {
  return channel == channels::kPlaceMatch || channel == channels::kConstraint;
}

bool IsInput(const LoggedMessage& message) {
  return !message.own && (IsFromAgents(message.channel) || IsMatchOrResult(message.channel));
}

// Whether it was queued before anyone answered the message before it: so a result of inter_map_ba
// comes before those of fusion for the same match.
bool FollowsAtOnce(const LoggedMessage& message) {
  return !message.own && IsMatchOrResult(message.channel);
}

// Name of the sending process; empty for agents.
std::string Speaker(const LogEvent& event) {
  if (event.channel == channels::kPlaceMatch) {
    return "place_recognition";
  }
  if (event.channel == channels::kMapState ||
      event.channel.starts_with(channels::kCorrectionPrefix)) {
    return "posegraph";
  }
  if (event.channel == channels::kRefinement) {
    return "global_ba";
  }
  if (event.channel == channels::kAnchor) {
    return "anchors";
  }
  constraint_t message{};
  if (event.channel == channels::kConstraint && DecodeMessage(event.data, &message)) {
    if (message.kind == constraint_t::KIND_DERIVED) {
      return "thinning";  // made while no process ran
    }
    return message.kind == place_candidate_t::KIND_INTRA ? "inter_map_ba" : "fusion";
  }
  return "";
}

// Reads the messages about maps; without HAVE messages, requests and retransmissions.
struct LoggedMessages {
  std::optional<int64_t> begin_utime;  // of the log's first event
  std::vector<LoggedMessage> messages;
};

LoggedMessages ReadMessages(const std::set<std::string>& processes, const fs::path& log,
                            double until_s, LogReadings* readings) {
  LoggedMessages read;
  const auto take = [&](const LogEvent& event) {
    read.begin_utime = read.begin_utime.value_or(event.utime);
    const double elapsed_s = 1e-6 * static_cast<double>(event.utime - *read.begin_utime);
    const std::string speaker = Speaker(event);
    if ((!speaker.empty() || IsFromAgents(event.channel)) && elapsed_s <= until_s) {
      read.messages.push_back({event.utime,
                               elapsed_s,
                               event.channel,
                               {event.data.begin(), event.data.end()},
                               processes.contains(speaker)});
    }
  };
  ReadLog(log.string(), take, readings);
  return read;
}

// The messages before the first keyframe that is later than `checkpoint_s`: so the messages about a
// keyframe are taken over either all or not at all.
std::span<LoggedMessage> Past(std::vector<LoggedMessage>& messages, double checkpoint_s) {
  const auto end = std::ranges::find_if(messages, [checkpoint_s](const LoggedMessage& message) {
    return IsKeyframe(message.channel) && message.elapsed_s > checkpoint_s;
  });
  if (end == messages.end()) {
    throw std::runtime_error(fmt::format(
        "--from-checkpoint {:g}: no keyframe comes after it, nothing is to be run", checkpoint_s));
  }
  return {messages.begin(), end};
}

// Gives the matching and verifying processes the messages that they sent, like the journal after a
// restart; these come from the log. Returns the number of these messages.
int64_t TakeOver(std::span<LoggedMessage> past, LocalBus& bus) {
  int64_t count = 0;
  for (LoggedMessage& message : past) {
    if (!IsMatchOrResult(message.channel)) {
      continue;
    }
    again_t again{};
    again.channel = message.channel;
    again.num_bytes = static_cast<int32_t>(message.data.size());
    again.data = message.data;
    if (message.channel == channels::kPlaceMatch) {
      PublishMessage(bus, channels::Again("place_recognition"), again);
    } else {
      PublishMessage(bus, channels::Again("inter_map_ba"), again);
      PublishMessage(bus, channels::Again("fusion"), again);
    }
    message.own = false;
    ++count;
  }
  bus.Drain();
  return count;
}

// Derived constraints, which no process computes again; keyed by their newer keyframe.
using DerivedConstraints = std::map<KeyframeId, std::vector<constraint_t>>;

DerivedConstraints ReadDerived(const std::vector<fs::path>& logs, LogReadings* readings) {
  DerivedConstraints derived;
  const auto take = [&derived](const LogEvent& event) {
    constraint_t message{};
    if (event.channel == channels::kConstraint && DecodeMessage(event.data, &message) &&
        message.kind == constraint_t::KIND_DERIVED) {
      if (const auto to = Parse(message.to).value) {
        derived[*to].push_back(message);
      }
    }
  };
  for (const fs::path& log : logs) {
    ReadLog(log.string(), take, readings);
  }
  return derived;
}

// Two logs with one map are a log and its copy, or a session's log and its journal: their keyframes
// would come twice.
void CheckMapsAreDistinct(const std::vector<fs::path>& logs,
                          const std::vector<std::vector<LoggedKeyframe>>& by_log) {
  std::map<MapId, size_t> log_of_map;
  for (size_t i = 0; i < logs.size(); ++i) {
    for (const LoggedKeyframe& keyframe : by_log[i]) {
      const size_t first = log_of_map.try_emplace(keyframe.id.map, i).first->second;
      if (first != i) {
        throw std::runtime_error(fmt::format("{} and {} both have the map {}: give one of them",
                                             logs[first].string(), logs[i].string(),
                                             ToString(keyframe.id.map)));
      }
    }
  }
}

}  // namespace

ReplaySummary Replay(const std::vector<fs::path>& logs, const ServerOptions& options,
                     double until_s, const fs::path& out_log, Progress& progress,
                     LogReadings* readings) {
  std::vector<std::vector<LoggedKeyframe>> by_log;
  LoggedEdits edits;
  for (const fs::path& log : logs) {
    by_log.push_back(ReadKeyframeLog(log, readings));
    Merge(ReadAnchorEdits(log, readings), &edits);
  }
  CheckMapsAreDistinct(logs, by_log);
  DerivedConstraints derived = ReadDerived(logs, readings);
  std::vector<LoggedKeyframe> keyframes = Interleave(std::move(by_log));
  const int64_t begin_utime = keyframes.front().captured_utime - keyframes.front().elapsed_us;
  DropLater(until_s, &keyframes);

  LocalBus bus;
  Recorder recorder(bus, options, out_log);
  recorder.SetTime(begin_utime);
  Server server(bus, options, {std::begin(kReplayed), std::end(kReplayed)});
  ReplaySummary summary;
  int64_t next_edit = 0;  // for several logs, edits are renumbered
  for (const LoggedKeyframe& keyframe : keyframes) {
    recorder.SetTime(begin_utime + keyframe.elapsed_us);
    bus.Publish(keyframe.channel, keyframe.data);
    bus.Drain();
    for (const constraint_t& constraint : derived[keyframe.id]) {
      PublishMessage(bus, std::string(channels::kConstraint), constraint);
      bus.Drain();
    }
    for (anchor_edit_t& edit : edits[keyframe.id]) {
      edit.seq = next_edit++;
      PublishMessage(bus, std::string(channels::kAnchorEdit), edit);
      bus.Drain();
    }
    progress.Update(++summary.keyframes, std::ssize(keyframes), "keyframes");
    const int32_t agent_id = keyframe.id.map.agent_id;
    if (std::find(summary.agent_ids.begin(), summary.agent_ids.end(), agent_id) ==
        summary.agent_ids.end()) {
      summary.agent_ids.push_back(agent_id);
    }
  }
  server.Finish();
  return summary;
}

int64_t ReplayPart(const fs::path& log, const ReplayedPart& part, const fs::path& out_log,
                   Progress& progress, LogReadings* readings) {
  ReadKeyframeLog(log, readings);  // throws if keyframes are missing
  auto [begin_utime, messages] = ReadMessages(part.processes, log, part.until_s, readings);
  LocalBus bus;
  Server server(bus, part.options, part.processes);
  int64_t taken_over = 0;
  if (part.checkpoint_s) {
    taken_over = TakeOver(Past(messages, *part.checkpoint_s), bus);
    if (taken_over == 0) {
      throw std::runtime_error(
          fmt::format("{}: no match and no verification result before the checkpoint; "
                      "--from-checkpoint goes on from a log "
                      "that has them: a replay's or a session's session.lcm, or a journal.lcm",
                      log.string()));
    }
  }

  size_t after_input = messages.size();
  while (after_input > 0 && !IsInput(messages[after_input - 1])) {
    --after_input;
  }
  Recorder recorder(bus, part.options, out_log);
  recorder.SetTime(*begin_utime);
  bool finished = false;
  bool queued = false;
  for (size_t i = 0; i < messages.size(); ++i) {
    if (!queued) {
      recorder.SetTime(messages[i].utime);
    }
    progress.Update(static_cast<int64_t>(i), std::ssize(messages), "messages");
    if (!messages[i].own) {
      bus.Publish(messages[i].channel, messages[i].data);
      queued = i + 1 < messages.size() && FollowsAtOnce(messages[i + 1]);
      if (!queued) {
        bus.Drain();
      }
    } else if (i >= after_input && !finished && !IsMatchOrResult(messages[i].channel)) {
      // The process sent this message, although no input is left: it worked because the bus was
      // quiet. (A match or a result may only have taken its time.)
      server.Finish();
      finished = true;
    }
  }
  if (!finished) {
    server.Finish();
  }
  return taken_over;
}

}  // namespace pangea
