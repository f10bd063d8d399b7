#include "bus/node.h"

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <fstream>

#include "messages/channels.h"

namespace pangea {
namespace {

constexpr size_t kHandlingWindow = 1000;
constexpr size_t kMaxReasons = 50;
constexpr int64_t kStatusInterval_us = 1'000'000;

float ResidentMegabytes() {
  std::ifstream statm("/proc/self/statm");
  int64_t total_pages = 0, resident_pages = 0;
  statm >> total_pages >> resident_pages;
  return static_cast<float>(resident_pages * sysconf(_SC_PAGESIZE)) / 1e6f;
}

float CpuSeconds() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return static_cast<float>(seconds(usage.ru_utime) + seconds(usage.ru_stime));
}

std::vector<counter_t> ToCounters(const std::map<std::string, int64_t>& from) {
  std::vector<counter_t> to;
  for (const auto& [name, count] : from) {
    counter_t counter{};
    counter.name = name;
    counter.count = count;
    to.push_back(counter);
  }
  return to;
}

// Adds what reached no handler: malformed datagrams to `refused`, losses to `counters`.
void AddUndelivered(const std::vector<Bus*>& buses, std::map<std::string, int64_t>* refused,
                    std::map<std::string, int64_t>* counters) {
  const auto add = [counters](const char* counter, int64_t count) {
    if (count != 0) {
      (*counters)[counter] += count;
    }
  };
  for (Bus* const bus : buses) {
    const Bus::Undelivered undelivered = bus->undelivered();
    for (const auto& [reason, count] : undelivered.refused) {
      (*refused)[reason] += count;
    }
    add("lost_in_queue", undelivered.no_room);
    add("lost_in_kernel", undelivered.by_kernel);
  }
}

}  // namespace

std::optional<int64_t> CounterOf(const status_t& status, std::string_view name) {
  const auto found =
      std::find_if(status.counters.begin(), status.counters.end(),
                   [name](const counter_t& counter) { return counter.name == name; });
  return found == status.counters.end() ? std::nullopt : std::optional(found->count);
}

int64_t Node::MonotonicNs() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

void Node::NoteHandling(int64_t ns) {
  handling_ms_.push_back(static_cast<float>(ns) * 1e-6f);
  if (handling_ms_.size() > kHandlingWindow) {
    handling_ms_.pop_front();
  }
}

void Node::Refuse(const std::string& reason) {
  const bool known = refused_.contains(reason) || refused_.size() < kMaxReasons;
  if (++refused_[known ? reason : "other reasons"] == 1) {
    Log(name_, "the first refused: " + (known ? reason : "other reasons"));
  }
}

status_t Node::Status(int64_t now_utime, int64_t pending, const std::string& summary) const {
  status_t status{};
  status.process = name_;
  status.utime = now_utime;
  status.started_utime = started_utime_;
  status.pid = getpid();
  status.summary = summary;
  status.messages_in = messages_in_;
  status.messages_out = messages_out_;
  status.pending = pending;
  status.dropped = dropped_;
  status.resends_asked = resends_asked_;
  if (!handling_ms_.empty()) {
    std::vector<float> sorted(handling_ms_.begin(), handling_ms_.end());
    std::sort(sorted.begin(), sorted.end());
    status.handling_median_ms = sorted[sorted.size() / 2];
    status.handling_p99_ms = sorted[sorted.size() * 99 / 100];
  }
  status.memory_mb = ResidentMegabytes();
  status.cpu_s = CpuSeconds();
  std::map<std::string, int64_t> refused = refused_, counters = counters_;
  AddUndelivered(heard_, &refused, &counters);
  status.refused = ToCounters(refused);
  status.num_refused = static_cast<int16_t>(status.refused.size());
  status.counters = ToCounters(counters);
  status.num_counters = static_cast<int16_t>(status.counters.size());
  return status;
}

bool Node::StatusIsDue(int64_t now_utime) {
  if (now_utime < next_status_utime_) {
    return false;
  }
  next_status_utime_ = now_utime + kStatusInterval_us;
  return true;
}

void Node::PublishStatus(int64_t now_utime, int64_t pending, const std::string& summary) {
  if (started_utime_ == 0) {
    started_utime_ = now_utime;
  }
  if (const auto change = state_changes_.Take(now_utime, summary)) {
    Log(name_, *change);
  }
  PublishMessage(bus_, channels::Status(name_), Status(now_utime, pending, summary));
}

}  // namespace pangea
