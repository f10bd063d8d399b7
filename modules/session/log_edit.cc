#include "session/log_edit.h"
#include "common/bus/log_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <deque>
#include <filesystem>
#include <lcm/lcm-cpp.hpp>
#include <optional>
#include <regex>
#include <stdexcept>

namespace pangea::session {
namespace {

// Appends events to a new log.
class LogWriter {
 public:
  explicit LogWriter(const std::string& path) : path_(path) {
    if (std::filesystem::exists(path)) {
      throw std::runtime_error(
          fmt::format("{}: exists; give another name, nothing is overwritten", path));
    }
    file_.emplace(path, "w");
    if (!file_->good()) {
      throw std::runtime_error(fmt::format("{}: cannot be written", path));
    }
  }

  void Write(int64_t utime, const std::string& channel, Bytes data) {
    lcm::LogEvent event;
    event.eventnum = count_++;
    event.timestamp = utime;
    event.channel = channel;
    event.datalen = static_cast<int32_t>(data.size());
    event.data = const_cast<uint8_t*>(data.data());  // it is only read
    if (file_->writeEvent(&event) != 0) {
      throw std::runtime_error(fmt::format("{}: cannot be written (disk full?)", path_));
    }
  }

  int64_t count() const { return count_; }

 private:
  std::string path_;
  std::optional<lcm::LogFile> file_;
  int64_t count_ = 0;
};

std::regex Expression(const std::string& text) {
  try {
    return std::regex(text, std::regex::extended);
  } catch (const std::regex_error&) {
    throw std::runtime_error(fmt::format(
        "--channels {}: is no regular expression; for example KEYFRAME_.* or (POSE_1|POSE_2)",
        text));
  }
}

// The place of an event in its log.
struct Place {
  int64_t utime = 0;
  size_t log = 0;
  size_t event = 0;
};

}  // namespace

int64_t CutLog(const std::string& log, const LogCut& cut, const std::string& out) {
  const std::regex channels = Expression(cut.channels);
  LogWriter writer(out);
  std::optional<int64_t> first;
  ReadLog(log, [&](const LogEvent& event) {
    first = first.value_or(event.utime);
    // Capture times may step back by a little, before the first one too.
    const double seconds = std::max(0.0, 1e-6 * static_cast<double>(event.utime - *first));
    if (seconds >= cut.from_s && seconds < cut.to_s && std::regex_match(event.channel, channels)) {
      writer.Write(event.utime, event.channel, event.data);
    }
  });
  return writer.count();
}

int64_t MergeLogs(const std::vector<std::string>& logs, const std::string& out) {
  LogWriter writer(out);
  std::vector<Place> places;
  for (size_t log = 0; log < logs.size(); ++log) {
    size_t event = 0;
    // Within a log its own order stands: capture times in a log may step back.
    int64_t latest = std::numeric_limits<int64_t>::min();
    ReadLog(logs[log], [&](const LogEvent& read) {
      latest = std::max(latest, read.utime);
      places.push_back({latest, log, event++});
    });
  }
  std::ranges::stable_sort(places, {}, &Place::utime);
  std::deque<lcm::LogFile> files;
  for (const std::string& log : logs) {
    files.emplace_back(log, "r");
  }
  for (const Place& place : places) {
    const lcm::LogEvent* event = files[place.log].readNextEvent();
    if (event == nullptr) {
      throw std::runtime_error(fmt::format("{}: changed while it was read", logs[place.log]));
    }
    writer.Write(
        event->timestamp, event->channel,
        Bytes(static_cast<const uint8_t*>(event->data), static_cast<size_t>(event->datalen)));
  }
  return writer.count();
}

}  // namespace pangea::session
