#include "log_tools/log_edit.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <deque>
#include <filesystem>
#include <limits>
#include <optional>
#include <regex>
#include <stdexcept>

#include "files/progress.h"
#include "log_file/log_reader.h"
#include "log_tools/message_fields.h"

namespace pangea {
namespace {

std::regex Expression(const std::string& text) {
  try {
    return std::regex(text, std::regex::extended);
  } catch (const std::regex_error&) {
    throw std::runtime_error(fmt::format(
        "--channels {}: is no regular expression; for example KEYFRAME_.* or (POSE_1|POSE_2)",
        text));
  }
}

// Calls handler(event, seconds since the log's first event).
template <typename Handler>
void ReadCut(const std::string& log, const LogCut& cut, LogReadings* readings,
             WhileReading while_reading, Handler handler) {
  const std::regex channels = Expression(cut.channels);
  std::optional<int64_t> first;
  int64_t latest = std::numeric_limits<int64_t>::min();
  const auto read = [&](const LogEvent& event) {
    first = first.value_or(event.utime);
    // Capture times may decrease: slightly, or because the clock was set. A replay does the same.
    latest = std::max(latest, event.utime);
    const double seconds = 1e-6 * static_cast<double>(latest - *first);
    if (seconds >= cut.from_s && seconds < cut.to_s && std::regex_match(event.channel, channels)) {
      handler(event, seconds);
    }
  };
  ReadLog(log, read, readings, while_reading);
}

[[noreturn]] void ThrowEmpty(const std::string& log, const LogCut& cut) {
  const std::string end = std::isfinite(cut.to_s) ? fmt::format("{:g} s", cut.to_s) : "the end";
  throw std::runtime_error(
      fmt::format("{}: no event of {} from {:g} s to {}; pangea-log info shows channels and times",
                  log, cut.channels, cut.from_s, end));
}

// Whether a path has an array index of eight or more, such as "a.b[12].c[3]".
bool IsFarInArray(const std::string& path) {
  constexpr int kShown = 8;
  for (size_t open = path.find('['); open != std::string::npos; open = path.find('[', open + 1)) {
    if (std::atoi(path.c_str() + open + 1) >= kShown) {
      return true;
    }
  }
  return false;
}

void ListFields(Bytes data, std::ostream& out) {
  const auto message = DecodeFields(data);
  if (!message) {
    out << "            does not decode\n";
    return;
  }
  size_t hidden = 0;
  for (const MessageField& field : message->fields) {
    if (IsFarInArray(field.path)) {
      ++hidden;
    } else {
      out << fmt::format("            {} = {}\n", field.path, field.value);
    }
  }
  if (hidden > 0) {
    out << fmt::format("            and {} further items of arrays\n", hidden);
  }
}

void ListJson(const LogEvent& event, std::ostream& out) {
  const auto message = DecodeFields(event.data);
  nlohmann::ordered_json json = {{"utime", event.utime}, {"channel", event.channel}};
  json["type"] = message ? nlohmann::ordered_json(message->type) : nullptr;
  json["message"] = message ? ToJson(*message) : nullptr;
  // Texts from the bus may be invalid UTF-8.
  out << json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace) << "\n";
}

// The position of an event in its log.
struct EventPlace {
  int64_t utime = 0;
  size_t log = 0;
  size_t event = 0;
};

}  // namespace

void ListEvents(const std::string& log, const LogCut& cut, ListAs as, std::ostream& out,
                LogReadings* readings) {
  bool is_empty = true;
  const auto list = [&](const LogEvent& event, double seconds) {
    is_empty = false;
    if (as == ListAs::kJson) {
      ListJson(event, out);
      return;
    }
    const auto type = TypeOf(event.data);
    out << fmt::format("{:>10.6f}  {}  {}  {} bytes\n", seconds, event.channel,
                       type.value_or("of no type of ours"), event.data.size());
    if (as == ListAs::kFields) {
      ListFields(event.data, out);
    }
  };
  ReadCut(log, cut, readings, WhileReading::kTellNothing, list);
  if (is_empty) {
    ThrowEmpty(log, cut);
  }
}

NewLog::NewLog(const std::string& path)
    : path_(path), made_(fmt::format("{}.new-{}", path, getpid())) {
  if (std::filesystem::exists(path_)) {
    throw std::runtime_error(
        fmt::format("{}: exists; give another name, nothing is overwritten", path_));
  }
}

NewLog::~NewLog() {
  if (writer_) {
    std::error_code ignored;
    std::filesystem::remove(made_, ignored);
  }
}

void NewLog::Write(int64_t utime, const std::string& channel, Bytes data) {
  if (!writer_) {
    writer_.emplace(made_);
  }
  writer_->Write(utime, channel, data);
  ++count_;
}

void NewLog::Keep() {
  std::filesystem::rename(made_, path_);
  writer_.reset();
}

int64_t CutLog(const std::string& log, const LogCut& cut, const std::string& out,
               LogReadings* readings) {
  NewLog made(out);
  ReadCut(log, cut, readings, WhileReading::kTellProgress, [&](const LogEvent& event, double) {
    made.Write(event.utime, event.channel, event.data);
  });
  if (made.count() == 0) {
    ThrowEmpty(log, cut);  // an empty file would not be a log
  }
  made.Keep();
  return made.count();
}

int64_t MergeLogs(const std::vector<std::string>& logs, const std::string& out,
                  LogReadings* readings) {
  NewLog made(out);
  std::vector<EventPlace> places;
  for (size_t log = 0; log < logs.size(); ++log) {
    size_t event = 0;
    // Each log keeps its own order, although its capture times may decrease.
    int64_t latest = std::numeric_limits<int64_t>::min();
    const auto note = [&](const LogEvent& read) {
      latest = std::max(latest, read.utime);
      places.push_back({latest, log, event++});
    };
    ReadLog(logs[log], note, readings);
  }
  if (places.empty()) {
    throw std::runtime_error(fmt::format("{}: there is no event to write", out));
  }
  std::ranges::stable_sort(places, {}, &EventPlace::utime);
  std::deque<LogReader> files;
  for (const std::string& log : logs) {
    files.emplace_back(log);
  }
  Progress progress("writing " + out);
  for (const EventPlace& place : places) {
    progress.Update(made.count(), std::ssize(places), "events");
    const LogEvent* event = files[place.log].Next();
    if (event == nullptr) {
      throw std::runtime_error(fmt::format("{}: changed while it was read", logs[place.log]));
    }
    made.Write(event->utime, event->channel, event->data);
  }
  made.Keep();
  return made.count();
}

}  // namespace pangea
