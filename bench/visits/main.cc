// Measures, over many visits of one hall with regular thinning: kept keyframes, memory and CPU of
// the server's cores, recall and accuracy.
//
// A visit consists of a recording's stored keyframes with new noise (visit.h), one day after the
// previous visit. It ends with the work of a quiet bus: all is solved and adjusted anew.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>
#include <map>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "bench/cores/cores.h"
#include "bench/process_use.h"
#include "bench/recognition/input.h"
#include "bench/visits/journal.h"
#include "bench/visits/visit.h"
#include "blas/blas.h"
#include "eval/metrics.h"

namespace pangea::bench {
namespace {

constexpr int64_t kDay_us = int64_t{24} * 3600 * 1'000'000;
constexpr int64_t kFirst_utime = 1'790'000'000'000'000;
// An accepted constraint with a larger error is wrong (bench/README.md).
constexpr double kWrong_m = 0.5, kWrong_rad = 5 * M_PI / 180;
constexpr int64_t kTruthGap_us = 100'000;

struct Recording {
  std::vector<Keyframe> keyframes;
  Trajectory truth;
};

std::vector<Recording> ReadRecordings(const std::vector<std::string>& logs,
                                      const std::vector<std::string>& truths) {
  if (logs.size() != truths.size()) {
    throw std::runtime_error(fmt::format("{} --logs, but {} --truth: give one for each log",
                                         logs.size(), truths.size()));
  }
  std::vector<Recording> recordings;
  for (size_t i = 0; i < logs.size(); ++i) {
    const auto agent = static_cast<int32_t>(i + 1);
    Input input = ReadInput({{agent, logs[i], truths[i]}});
    recordings.push_back({std::move(input.keyframes), std::move(input.truth[agent])});
  }
  return recordings;
}

struct Row {
  int visit = 0;
  size_t keyframes = 0, maps = 0, constraints = 0;
  std::map<std::string, Use> use;  // CPU: of this visit
  size_t new_keyframes = 0, recognised = 0, wrong = 0;
  double joint_m = 0, newest_m = 0;  // joint ATE of all keyframes; part of the newest visit
  size_t groups = 0;
  double thin_ms = 0;
};

class Bench {
 public:
  explicit Bench(std::vector<Recording> recordings) : recordings_(std::move(recordings)) {
    Start();
  }

  Row Visit(int visit) {
    const Recording& recording = recordings_[visit % recordings_.size()];
    Row row;
    row.visit = visit + 1;
    cores_->TakeUse();
    const std::vector<Keyframe> keyframes =
        VisitAgain(recording.keyframes, kFirst_utime + visit * kDay_us, visit);
    truth_[keyframes.front().id.map] = &recording.truth;
    std::vector<Journal::Entry>& entries = journal_.maps.emplace_back();
    for (const Keyframe& keyframe : keyframes) {
      utime_[keyframe.id] = keyframe.utime;
      entries.push_back({cores_->Take(keyframe), keyframe.id.map.opened_utime});
      bool recognised = false;
      for (const Constraint& result : entries.back().step.results) {
        const bool between_maps = result.from.map != result.to.map;
        recognised |= between_maps && (result.accepted || result.reason == kRedundant);
        row.wrong += result.accepted && IsWrong(result) ? 1 : 0;
      }
      row.recognised += recognised ? 1 : 0;
    }
    cores_->Quiet();
    row.use = cores_->TakeUse();
    row.new_keyframes = keyframes.size();
    Measure(keyframes.front().id.map, &row);
    return row;
  }

  // Thins the journal one hour after a visit.
  void Thin(const Thinning::Options& options, Row* row) {
    const double begin = CpuMs();
    cores_.reset();
    journal_.Thin(options, kFirst_utime + (row->visit - 1) * kDay_us + kDay_us / 24);
    row->thin_ms = CpuMs() - begin;
    Count(row);
    Start();
  }

 private:
  // Starts the server from the journal.
  void Start() {
    cores_ = std::make_unique<Cores>(false, GlobalBaOptions{});
    for (const auto& entries : journal_.maps) {
      for (const Journal::Entry& entry : entries) {
        cores_->Remember(entry.step);
      }
    }
    cores_->Start(true);
  }

  // Nothing where the ground truth has a gap.
  std::optional<Rigid3> Truth(const KeyframeId& id) const {
    return Interpolate(*truth_.at(id.map), utime_.at(id), kTruthGap_us);
  }

  bool IsWrong(const Constraint& constraint) const {
    const std::optional<Rigid3> from = Truth(constraint.from), to = Truth(constraint.to);
    if (!from || !to) {
      return false;
    }
    const Rigid3 T = from->Inverse() * *to;
    return (T.t - constraint.T_from_to.t).norm() > kWrong_m ||
           T.q.angularDistance(constraint.T_from_to.q) > kWrong_rad;
  }

  void Count(Row* row) const {
    row->keyframes = journal_.num_keyframes();
    row->maps = journal_.maps.size();
    row->constraints = journal_.num_accepted();
  }

  void Measure(const MapId& newest, Row* row) const {
    Count(row);
    const std::vector<MapState> states = cores_->States();
    row->groups = states.size();
    for (const MapState& state : states) {
      std::map<MapId, std::vector<PosePair>> pairs;
      for (const KeyframePose& pose : state.keyframes) {
        if (const auto truth = Truth(pose.id)) {
          pairs[pose.id.map].push_back({pose.utime, pose.T_map_body, *truth});
        }
      }
      if (!pairs.contains(newest)) {
        continue;
      }
      std::vector<std::vector<PosePair>> agents;
      size_t index = 0;
      for (auto& [map, of_map] : pairs) {
        index = map == newest ? agents.size() : index;
        agents.push_back(std::move(of_map));
      }
      if (const auto joint = JointAbsoluteError(agents, TrajectoryAlignmentKind::kYaw)) {
        row->joint_m = joint->position_m.rmse;
        row->newest_m = joint->agents[index].position_m.rmse;
      }
    }
  }

  std::vector<Recording> recordings_;
  Journal journal_;
  std::unique_ptr<Cores> cores_;
  std::map<MapId, const Trajectory*> truth_;
  std::map<KeyframeId, int64_t> utime_;
};

constexpr const char* kProcesses[] = {"place_recognition", "inter_map_ba", "fusion",
                                      "posegraph",         "global_ba",    "map_points"};

void PrintHead() {
  fmt::print(
      "| visits | maps | keyframes | constraints | groups | heap MB: {} | CPU ms a new keyframe: "
      "sum, the same | recall | wrong | ATE m: joint, newest | thinning s |\n"
      "|---|---|---|---|---|---|---|---|---|---|---|\n",
      fmt::join(kProcesses, ", "));
}

void Print(const Row& row) {
  std::vector<std::string> heap, cpu;
  double sum_ms = 0;
  for (const char* process : kProcesses) {
    const Use& use = row.use.at(process);
    heap.push_back(fmt::format("{:.1f}", 1e-6 * use.heap_bytes));
    const double ms = use.cpu_ms / static_cast<double>(row.new_keyframes);
    cpu.push_back(fmt::format("{:.1f}", ms));
    sum_ms += ms;
  }
  fmt::print(
      "| {} | {} | {} | {} | {} | {} | {:.1f}, {} | {:.3f} | {} | {:.4f}, {:.4f} | {:.1f} |\n",
      row.visit, row.maps, row.keyframes, row.constraints, row.groups, fmt::join(heap, ", "),
      sum_ms, fmt::join(cpu, ", "),
      static_cast<double>(row.recognised) / static_cast<double>(row.new_keyframes), row.wrong,
      row.joint_m, row.newest_m, 1e-3 * row.thin_ms);
  std::fflush(stdout);
}

}  // namespace
}  // namespace pangea::bench

int main(int argc, char** argv) {
  CLI::App app("What visit after visit of one hall costs the server, and how good its map is",
               "pangea-visits-bench");
  std::vector<std::string> logs, truths;
  int visits = 20, thin_every = 5;
  app.add_option("--logs", logs, "keyframe logs, one agent each: 1, 2, ... in this order")
      ->required();
  app.add_option("--truth", truths, "their ground truth: csv, TUM or a recording's folder")
      ->required();
  app.add_option("--visits", visits, "how many; the recordings by turns")->capture_default_str();
  app.add_option("--thin-every", thin_every, "visits between thinnings; 0: never")
      ->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  try {
    pangea::bench::Bench bench(pangea::bench::ReadRecordings(logs, truths));
    fmt::print("{}\n", pangea::ToString(pangea::LoadedBlas()));
    pangea::bench::PrintHead();
    for (int visit = 0; visit < visits; ++visit) {
      pangea::bench::Row row = bench.Visit(visit);
      if (thin_every > 0 && (visit + 1) % thin_every == 0) {
        bench.Thin({}, &row);
      }
      pangea::bench::Print(row);
    }
    return 0;
  } catch (const std::exception& error) {
    fmt::print(stderr, "pangea-visits-bench: {}\n", error.what());
    return 1;
  }
}
