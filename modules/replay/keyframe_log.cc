#include "replay/keyframe_log.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <stdexcept>

#include "log_file/log_reader.h"
#include "messages/channels.h"
#include "messages/encoding.h"
#include "messages/messages.h"

namespace pangea {
namespace {

// Throws with the missing keyframes: "map 1/17…: keyframes 12 to 15 are missing". If an odometry
// edge leads across a gap, its keyframes do not exist, and no process waits for them. `edges`: the
// seq at which each keyframe's edge begins.
// `refused`: the keyframes that the server's processes would refuse.
void CheckGaps(const std::filesystem::path& log, const std::map<MapId, std::set<int32_t>>& seqs,
               const std::map<KeyframeId, int32_t>& edges, const std::string& refused,
               const LogReading& reading) {
  std::string gaps;
  for (const auto& [map, present] : seqs) {
    int32_t next = 0;
    for (const int32_t seq : present) {
      const auto edge = edges.find({map, seq});
      const bool led_over = edge != edges.end() && edge->second == next - 1;
      if (seq != next && !led_over) {
        gaps += fmt::format("\n  map {}: keyframes {} to {}", ToString(map), next, seq - 1);
      }
      next = seq + 1;
    }
  }
  if (gaps.empty()) {
    return;
  }
  throw std::runtime_error(fmt::format(
      "{}: keyframes are missing, and a replay without them would not be the same:{}{}\n{}",
      log.string(), gaps, refused,
      reading.whole()
          ? "The server's journal (journal.lcm beside a session.lcm) has every keyframe: "
            "replay that."
          : "The log is damaged, and they were lost there. Another capture of the same "
            "session, or the server's journal (journal.lcm beside a session.lcm), may "
            "have them: replay that."));
}

// The capture of a map's first keyframe relates the map's sensor clock to the log's time. After
// that the sensor clock counts, because a capture may be delayed, or faster than real time.
void SetElapsedBySensorClocks(std::vector<LoggedKeyframe>* log) {
  const int64_t begin = log->front().captured_utime;
  std::map<MapId, int64_t> begin_by_sensor;
  for (LoggedKeyframe& keyframe : *log) {
    const int64_t captured_us = keyframe.captured_utime - begin;
    const auto known = begin_by_sensor.try_emplace(keyframe.id.map, keyframe.utime - captured_us);
    keyframe.elapsed_us = keyframe.utime - known.first->second;
  }
}

}  // namespace

std::vector<LoggedKeyframe> ReadKeyframeLog(const std::filesystem::path& log,
                                            LogReadings* readings) {
  std::vector<LoggedKeyframe> keyframes;
  std::map<MapId, std::set<int32_t>> seqs;
  std::map<KeyframeId, int32_t> edges;
  std::string refused;
  std::optional<int64_t> begin;
  int64_t latest = std::numeric_limits<int64_t>::min();
  const auto take = [&](const LogEvent& event) {
    begin = begin.value_or(event.utime);
    latest = std::max(latest, event.utime);
    if (!event.channel.starts_with(channels::kKeyframePrefix)) {
      return;
    }
    LoggedKeyframe keyframe;
    keyframe.channel = event.channel;
    keyframe.data.assign(event.data.begin(), event.data.end());
    KeyframeMessage message;
    const bool decoded = DecodeMessage(event.data, &message);
    const auto id = decoded ? Parse(message.id) : Parsed<KeyframeId>{};
    if (!id.value) {
      throw std::runtime_error(fmt::format("{}: event {} on {} is not a keyframe of this version",
                                           log.string(), event.number, event.channel));
    }
    keyframe.id = *id.value;
    keyframe.utime = message.utime;
    keyframe.captured_utime = latest;
    keyframe.elapsed_us = latest - *begin;
    if (const auto parsed = Parse(message); !parsed.value) {
      refused += fmt::format("\n  event {} on {} is refused: {}", event.number, event.channel,
                             parsed.refused);
      keyframes.push_back(std::move(keyframe));
    } else if (seqs[keyframe.id.map].insert(keyframe.id.seq).second) {
      if (message.has_edge) {
        edges[keyframe.id] = message.edge_from_seq;
      }
      keyframes.push_back(std::move(keyframe));
    }
  };
  ReadLog(log.string(), take, readings);
  if (keyframes.empty()) {
    throw std::runtime_error(fmt::format("{}: no KEYFRAME_* in this log", log.string()));
  }
  CheckGaps(log, seqs, edges, refused,
            readings == nullptr ? LogReading() : readings->at(log.string()));
  return keyframes;
}

std::vector<LoggedKeyframe> ReadKeyframeLogOf(const std::filesystem::path& log, int32_t agent_id,
                                              LogReadings* readings) {
  std::vector<LoggedKeyframe> keyframes = ReadKeyframeLog(log, readings);
  std::erase_if(keyframes, [agent_id](const LoggedKeyframe& keyframe) {
    return keyframe.id.map.agent_id != agent_id;
  });
  if (keyframes.empty()) {
    throw std::runtime_error(
        fmt::format("{}: no keyframes of agent {} in this log; an agent has "
                    "the id its keyframes were made with",
                    log.string(), agent_id));
  }
  return keyframes;
}

std::vector<LoggedKeyframe> Interleave(std::vector<std::vector<LoggedKeyframe>> logs) {
  if (logs.size() == 1) {
    return std::move(logs.front());
  }
  for (std::vector<LoggedKeyframe>& log : logs) {
    SetElapsedBySensorClocks(&log);
  }
  std::vector<LoggedKeyframe> merged;
  std::vector<size_t> next(logs.size(), 0);
  while (true) {
    size_t best = logs.size();
    for (size_t i = 0; i < logs.size(); ++i) {
      if (next[i] < logs[i].size() &&
          (best == logs.size() ||
           logs[i][next[i]].elapsed_us < logs[best][next[best]].elapsed_us)) {
        best = i;
      }
    }
    if (best == logs.size()) {
      return merged;
    }
    merged.push_back(std::move(logs[best][next[best]++]));
  }
}

}  // namespace pangea
