#include "log_tools/log_info.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <string_view>
#include <vector>

#include "log_file/log_event.h"
#include "log_file/log_reader.h"
#include "messages/channels.h"
#include "messages/encoding.h"
#include "messages/messages.h"

namespace pangea {
namespace {

double Seconds(int64_t us) { return 1e-6 * static_cast<double>(us); }

void AddKeyframe(Bytes data, LogSummary* summary) {
  KeyframeMessage message{};
  if (DecodeMessage(data, &message)) {
    if (const auto id = Parse(message.id); id.value) {
      summary->keyframes[id.value->map].insert(id.value->seq);
    }
  }
}

void AddResult(Bytes data, LogSummary* summary) {
  constraint_t message{};
  if (DecodeMessage(data, &message)) {
    ++summary->results[message.accepted ? "accepted" : message.reason];
  }
}

// "0-62", or with gaps: "0-11, 16-62".
std::string Ranges(const std::set<int32_t>& seqs) {
  std::string text;
  for (auto it = seqs.begin(); it != seqs.end();) {
    const int32_t first = *it;
    int32_t last = first;
    while (++it != seqs.end() && *it == last + 1) {
      last = *it;
    }
    text += fmt::format("{}{}-{}", text.empty() ? "" : ", ", first, last);
  }
  return text;
}

constexpr double kShortest_s = 0.1;  // shortest time for a rate; shorter is a burst

std::string ChannelTable(const LogSummary& summary) {
  size_t width = 7;
  for (const auto& [channel, of] : summary.channels) {
    width = std::max(width, channel.size());
  }
  std::string text = fmt::format("\n{:<{}} {:>8} {:>10} {:>8} {:>9} {:>9}\n", "channel", width,
                                 "events", "kB", "Hz", "from s", "to s");
  for (const auto& [channel, of] : summary.channels) {
    const double seconds = Seconds(of.last_utime - of.first_utime);
    text += fmt::format("{:<{}} {:>8} {:>10.1f} {:>8} {:>9.2f} {:>9.2f}\n", channel, width,
                        of.events, 1e-3 * static_cast<double>(of.bytes),
                        seconds > kShortest_s
                            ? fmt::format("{:.2f}", static_cast<double>(of.events - 1) / seconds)
                            : "",
                        Seconds(of.first_utime - summary.first_utime),
                        Seconds(of.last_utime - summary.first_utime));
  }
  return text;
}

}  // namespace

std::set<int32_t> AgentsIn(const std::vector<std::string>& logs, LogReadings* readings) {
  std::set<int32_t> agents;
  const auto add = [&agents](const LogEvent& event) {
    for (const std::string_view prefix : {channels::kKeyframePrefix, channels::kPosePrefix}) {
      if (event.channel.starts_with(prefix)) {
        agents.insert(channels::AgentOf(event.channel, prefix));
      }
    }
  };
  for (const std::string& log : logs) {
    ReadLog(log, add, readings);
  }
  return agents;
}

LogSummary Summarise(const std::string& log) {
  LogSummary summary;
  LogReadings readings;
  const auto add = [&summary](const LogEvent& event) {
    if (summary.events == 0) {
      summary.first_utime = summary.last_utime = event.utime;
    }
    ++summary.events;
    summary.bytes +=
        static_cast<int64_t>(LogEventHeader::kBytes + event.channel.size() + event.data.size());
    summary.last_utime = std::max(summary.last_utime, event.utime);
    ChannelSummary& channel = summary.channels[event.channel];
    if (channel.events++ == 0) {
      channel.first_utime = channel.last_utime = event.utime;
    }
    channel.bytes += static_cast<int64_t>(event.data.size());
    channel.last_utime = std::max(channel.last_utime, event.utime);
    if (event.channel.starts_with(channels::kKeyframePrefix)) {
      AddKeyframe(event.data, &summary);
    } else if (event.channel == channels::kConstraint) {
      AddResult(event.data, &summary);
    }
  };
  ReadLog(log, add, &readings);
  summary.reading = readings.at(log);
  return summary;
}

std::string ToText(const LogSummary& summary, const std::string& log) {
  const auto started = fmt::gmtime(static_cast<std::time_t>(summary.first_utime / 1'000'000));
  std::string text =
      fmt::format("{}: {} events, {:.1f} MB, {:.1f} s from {:%Y-%m-%d %H:%M:%S} UTC\n", log,
                  summary.events, 1e-6 * static_cast<double>(summary.bytes),
                  Seconds(summary.last_utime - summary.first_utime), started);
  if (!summary.reading.whole()) {
    text += DescribeLoss(summary.reading) + "\n";
  }
  if (summary.reading.checksums > 0) {
    text += fmt::format("with checksums of its events, in {} messages on CHECKSUMS\n",
                        summary.reading.checksums);
  }
  text += ChannelTable(summary);
  if (!summary.keyframes.empty()) {
    text += "\nmap                        keyframes  seq\n";
    for (const auto& [map, seqs] : summary.keyframes) {
      text += fmt::format("{:<26} {:>9}  {}\n", ToString(map), seqs.size(), Ranges(seqs));
    }
  }
  if (!summary.results.empty()) {
    text += "\nverification results\n";
    for (const auto& [reason, count] : summary.results) {
      text += fmt::format("{:>8}  {}\n", count, reason);
    }
  }
  return text;
}

}  // namespace pangea
