#include "server/checkpoints.h"

#include <fmt/format.h>
#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <iostream>
#include <stdexcept>
#include <system_error>
#include <thread>
#include <utility>

#include "bus/process.h"

namespace pangea {
namespace {

namespace fs = std::filesystem;

constexpr const char* kProcesses[] = {"place_recognition", "posegraph", "inter_map_ba", "fusion",
                                      "global_ba",         "map_points"};
// Not during the start of the server.
constexpr double kFirstAfter_s = 60;
// A new round begins when the journal has grown by this many bytes and by this share: a round
// rewrites every checkpoint completely.
constexpr int64_t kMinBytes = 20'000'000;
constexpr int64_t kShare = 20;
constexpr int kBehindTheServer = 10;
constexpr std::chrono::milliseconds kLookInterval{20};

}  // namespace

Checkpoints::Checkpoints(fs::path folder, fs::path journal, const fs::path& logs)
    : folder_(std::move(folder)), journal_(std::move(journal)), log_(logs / "checkpoints.txt") {}

std::vector<std::string> Checkpoints::ArgumentsOf(const std::string& process) const {
  if (std::ranges::find(kProcesses, process) == std::end(kProcesses)) {
    return {};
  }
  return {"--checkpoint", (folder_ / process).string()};
}

void Checkpoints::Add(const std::string& process, std::vector<std::string> argv) {
  if (!ArgumentsOf(process).empty()) {
    argv.insert(argv.end(), {"--write-checkpoint", journal_.string()});
    writers_.push_back({process, std::move(argv)});
  }
}

bool Checkpoints::Drop(const std::string& process) {
  const auto of_process = [&](const Writer& writer) { return writer.process == process; };
  if (std::erase_if(writers_, of_process) == 0) {
    return false;
  }
  std::erase_if(to_run_, of_process);
  if (running_ && running_->name() == process) {
    running_.reset();  // ends it
  }
  std::error_code error;
  return fs::remove(folder_ / process, error);
}

int64_t Checkpoints::JournalBytes() const {
  std::error_code error;
  const auto size = fs::file_size(journal_, error);
  return error ? 0 : static_cast<int64_t>(size);
}

void Checkpoints::BeginRound() {
  journal_bytes_ = JournalBytes();
  to_run_ = {writers_.begin(), writers_.end()};
}

bool Checkpoints::Advance(int niceness) {
  if (running_ && running_->running()) {
    return true;
  }
  running_.reset();
  if (to_run_.empty()) {
    return false;
  }
  const Writer next = std::move(to_run_.front());
  to_run_.pop_front();
  try {
    running_.emplace(next.process, next.argv, log_);
    setpriority(PRIO_PROCESS, static_cast<id_t>(running_->pid()), niceness);
  } catch (const std::runtime_error& error) {  // the server works without this checkpoint
    std::cerr << fmt::format("no checkpoint of {}: {}\n", next.process, error.what());
  }
  return true;
}

void Checkpoints::Tick(double now_s) {
  began_s_ = began_s_.value_or(now_s);
  if (Advance(kBehindTheServer)) {
    return;
  }
  const int64_t bytes = JournalBytes();
  const bool due = journal_bytes_ ? bytes - *journal_bytes_ >= std::max(kMinBytes, bytes / kShare)
                                  : now_s >= *began_s_ + kFirstAfter_s;
  if (due) {
    BeginRound();
  }
}

void Checkpoints::Finish() {
  if (journal_bytes_ != JournalBytes()) {
    BeginRound();
  }
  for (const int signals = StopSignals(); StopSignals() == signals && Advance(0);) {
    std::this_thread::sleep_for(kLookInterval);
  }
}

}  // namespace pangea
