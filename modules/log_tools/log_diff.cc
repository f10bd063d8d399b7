#include "log_tools/log_diff.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <utility>

#include "log_file/log_reader.h"
#include "log_tools/message_fields.h"
#include "messages/channels.h"

namespace pangea {
namespace {

struct Message {
  double seconds = 0;
  std::vector<uint8_t> data;
};
using Channels = std::map<std::string, std::vector<Message>>;

bool TellsOfTheRun(const std::string& channel) {
  return channel.starts_with(channels::kStatusPrefix) ||
         channel.starts_with(channels::kAgainPrefix) ||
         channel.starts_with(channels::kOptionsPrefix) || channel == channels::kHave ||
         channel == channels::kJournalFile || channel == channels::kResendRequest ||
         channel == channels::kVerificationRequest || channel == "LCM_SELF_TEST";
}

Channels ReadChannels(const std::string& log, double until_s, LogReadings* readings) {
  Channels channels;
  std::optional<int64_t> begin;
  const auto read = [&](const LogEvent& event) {
    begin = begin.value_or(event.utime);
    const double seconds = std::max(0.0, 1e-6 * static_cast<double>(event.utime - *begin));
    if (!TellsOfTheRun(event.channel) && seconds <= until_s) {
      channels[event.channel].push_back({seconds, {event.data.begin(), event.data.end()}});
    }
  };
  ReadLog(log, read, readings);
  return channels;
}

// Each run has its own revisions: from the clock in a live run, from 1 in a replay.
bool IsRevision(const std::string& path) { return path == "revision" || path == "group_revision"; }

// Empty if they are equal.
std::string HowTheyDiffer(const Message& a, const Message& b) {
  const auto fields_a = DecodeFields(a.data), fields_b = DecodeFields(b.data);
  if (!fields_a || !fields_b) {
    return fmt::format("{} | {} bytes that are no message of ours", a.data.size(), b.data.size());
  }
  if (fields_a->type != fields_b->type) {
    return fmt::format("a {} | a {}", fields_a->type, fields_b->type);
  }
  std::map<std::string, std::string> values_b;
  for (const MessageField& field : fields_b->fields) {
    values_b.emplace(field.path, field.value);
  }
  std::string first;
  size_t count = 0;
  for (const MessageField& field : fields_a->fields) {
    const auto other = values_b.find(field.path);
    const std::string value_b = other == values_b.end() ? "absent" : other->second;
    if (value_b != field.value && !IsRevision(field.path) && count++ == 0) {
      first = fmt::format("{}: {} | {}", field.path, field.value, value_b);
    }
    if (other != values_b.end()) {
      values_b.erase(other);
    }
  }
  for (const auto& [path, value] : values_b) {
    if (count++ == 0) {
      first = fmt::format("{}: absent | {}", path, value);
    }
  }
  return count > 1 ? fmt::format("{}, and {} more", first, count - 1) : first;
}

ChannelDiff Compare(const std::string& channel, const std::vector<Message>& a,
                    const std::vector<Message>& b) {
  ChannelDiff diff{channel, static_cast<int64_t>(a.size()), static_cast<int64_t>(b.size()), {}, 0,
                   ""};
  size_t same = 0;
  const auto is_same = [](const Message& x, const Message& y) {
    return x.data == y.data || HowTheyDiffer(x, y).empty();
  };
  while (same < a.size() && same < b.size() && is_same(a[same], b[same])) {
    ++same;
  }
  if (same == a.size() && same == b.size()) {
    return diff;
  }
  diff.first = static_cast<int64_t>(same);
  diff.seconds = same < a.size() ? a[same].seconds : b[same].seconds;
  if (same < a.size() && same < b.size()) {
    diff.how = HowTheyDiffer(a[same], b[same]);
  } else {
    diff.how = fmt::format("the {} has {}", same < a.size() ? "second" : "first",
                           same > 0 ? "no more" : "none");
  }
  return diff;
}

}  // namespace

const ChannelDiff* LogDiff::First() const {
  const ChannelDiff* first = nullptr;
  // A channel in only one log comes after all others; for instance, a replay has no poses.
  const auto order = [](const ChannelDiff& channel) {
    return std::pair(channel.count_a == 0 || channel.count_b == 0, channel.seconds);
  };
  for (const ChannelDiff& channel : channels) {
    if (channel.first && (first == nullptr || order(channel) < order(*first))) {
      first = &channel;
    }
  }
  return first;
}

LogDiff DiffLogs(const std::string& a, const std::string& b, double until_s,
                 LogReadings* readings) {
  Channels channels_a = ReadChannels(a, until_s, readings);
  Channels channels_b = ReadChannels(b, until_s, readings);
  LogDiff diff;
  for (const auto& [channel, messages] : channels_a) {
    diff.channels.push_back(Compare(channel, messages, channels_b[channel]));
    channels_b.erase(channel);
  }
  for (const auto& [channel, messages] : channels_b) {
    diff.channels.push_back(Compare(channel, {}, messages));
  }
  std::ranges::sort(diff.channels, {}, &ChannelDiff::channel);
  return diff;
}

std::string ToText(const LogDiff& diff) {
  size_t width = 7;
  for (const ChannelDiff& channel : diff.channels) {
    width = std::max(width, channel.channel.size());
  }
  std::string text =
      fmt::format("{:<{}} {:>8} {:>8} {:>8}  then\n", "channel", width, "first", "second", "same");
  for (const ChannelDiff& channel : diff.channels) {
    text += fmt::format("{:<{}} {:>8} {:>8} {:>8}{}{}\n", channel.channel, width, channel.count_a,
                        channel.count_b, channel.first.value_or(channel.count_a),
                        channel.first ? "  " : "", channel.how);
  }
  const ChannelDiff* first = diff.First();
  text += first == nullptr ? "\nno message differs\n"
                           : fmt::format("\nthey part at {:.3f} s, with message {} on {}: {}\n",
                                         first->seconds, *first->first, first->channel, first->how);
  return text;
}

}  // namespace pangea
