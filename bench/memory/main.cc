// Measures heap, resident memory and CPU of the server's cores over the number of keyframes: stored
// keyframes are played repeatedly with new map ids, each time with different flipped bits in every
// descriptor, like another visit of the place.

#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <fstream>
#include <functional>
#include <map>
#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "anchors/anchors.h"
#include "bench/process_use.h"
#include "files/scratch_file.h"
#include "global_ba/global_ba.h"
#include "loop_verification/loop_verifier.h"
#include "map_points/map_points.h"
#include "messages/encoding.h"
#include "messages/messages.h"
#include "place_recognition/place_recognition.h"
#include "posegraph/posegraph.h"
#include "replay/keyframe_log.h"

namespace pangea::bench {
namespace {

constexpr int kFlippedBits = 20;  // of 256
// Offset of agent ids, because two logs may have the same map ids.
constexpr int32_t kAgentsOfALog = 100;

std::vector<LoggedKeyframe> ReadAll(const std::vector<std::string>& logs) {
  std::vector<LoggedKeyframe> all;
  for (size_t i = 0; i < logs.size(); ++i) {
    for (LoggedKeyframe& keyframe : ReadKeyframeLog(logs[i])) {
      keyframe.id.map.agent_id += static_cast<int32_t>(kAgentsOfALog * i);
      all.push_back(std::move(keyframe));
    }
  }
  return all;
}

// The n-th keyframe of the endless walk.
class Walk {
 public:
  explicit Walk(std::vector<LoggedKeyframe> stored) : stored_(std::move(stored)) {}

  Keyframe At(int n) const {
    const int visit = n / static_cast<int>(stored_.size());
    const LoggedKeyframe& logged = stored_[n % stored_.size()];
    KeyframeMessage message;
    DecodeMessage(logged.data, &message);
    Keyframe keyframe = *std::move(Parse(message).value);
    keyframe.id = logged.id;
    keyframe.id.map.opened_utime += visit;
    std::mt19937_64 rng(n);
    for (Corner& corner : keyframe.corners) {
      for (int i = 0; visit > 0 && i < kFlippedBits; ++i) {
        const uint64_t bit = rng() % kDescriptorBits;
        corner.descriptor[bit / 64] ^= uint64_t{1} << (bit % 64);
      }
    }
    return keyframe;
  }

 private:
  std::vector<LoggedKeyframe> stored_;
};

double ResidentBytes() {
  std::ifstream statm("/proc/self/statm");
  int64_t size = 0, resident = 0;
  statm >> size >> resident;
  return static_cast<double>(resident) * static_cast<double>(sysconf(_SC_PAGESIZE));
}

// A core that takes keyframes. `look`: its later work on them, if that is measured.
struct Subject {
  std::function<void(const Keyframe&)> take;
  std::function<uint64_t(const Keyframe&)> look = {};  // a hash of the result
};

uint64_t HashOf(const PlaceMatch& match) {
  uint64_t hash = 0;
  const auto mix = [&hash](uint64_t value) {
    hash = (hash ^ value) * 0x9e3779b97f4a7c15;
    hash ^= hash >> 29;
  };
  for (const PlaceCandidate& candidate : match.candidates) {
    mix(StableHash(match.query, candidate.match, static_cast<uint64_t>(1e9 * candidate.score)));
    for (const auto& [a, b] : candidate.corner_matches) {
      mix(static_cast<uint64_t>(a) << 32 | static_cast<uint32_t>(b));
    }
  }
  for (const std::string& reason : match.rejected) {
    mix(std::hash<std::string>()(reason));
  }
  return hash;
}

std::map<std::string, std::function<Subject()>> Subjects() {
  const auto taking = [](auto core) {
    return Subject{[core](const Keyframe& keyframe) { core->Take(keyframe); }};
  };
  return {
      {"place_recognition",
       [] {
         auto core = std::make_shared<PlaceRecognition>(PlaceRecognitionOptions{},
                                                        std::make_shared<ScratchFile>());
         return Subject{[core](const Keyframe& keyframe) { core->Remember(keyframe, {}); },
                        [core](const Keyframe& keyframe) { return HashOf(core->Add(keyframe)); }};
       }},
      {"fusion",
       [] {
         auto core =
             std::make_shared<LoopVerifier>(LoopVerifierOptions{}, std::make_shared<ScratchFile>());
         return Subject{[core](const Keyframe& keyframe) { core->Add(keyframe); }};
       }},
      {"anchors",
       [=] {
         return taking(
             std::make_shared<Anchors>(AnchorsOptions{}, std::make_shared<ScratchFile>()));
       }},
      {"posegraph",
       [] {
         auto core = std::make_shared<PoseGraph>(PoseGraphOptions{});
         return Subject{[core](const Keyframe& keyframe) { core->AddKeyframe(keyframe); }};
       }},
      {"global_ba",
       [=] {
         return taking(
             std::make_shared<GlobalBa>(GlobalBaOptions{}, std::make_shared<ScratchFile>()));
       }},
      {"map_points",
       [=] { return taking(std::make_shared<MapPoints>(std::make_shared<ScratchFile>())); }},
  };
}

void Measure(const Walk& walk, const Subject& subject, const std::vector<int>& counts, int looks) {
  double corners = 0;
  constexpr int kSample = 500;
  for (int n = 0; n < kSample; ++n) {
    corners += static_cast<double>(walk.At(n).corners.size()) / kSample;
  }
  fmt::print("{:.0f} corners a keyframe\n", corners);
  const double heap = HeapBytes(), resident = ResidentBytes();
  fmt::print(
      "| keyframes | heap MB | resident MB | heap kB a keyframe | CPU ms to take | to look | "
      "hash |\n|---|---|---|---|---|---|---|\n");
  double last_heap = heap;
  int taken = 0;
  for (const int count : counts) {
    const int first = taken;
    double take_ms = 0, look_ms = 0;
    int looked = 0;
    uint64_t hash = 0;
    for (; taken < count; ++taken) {
      const Keyframe keyframe = walk.At(taken);
      const bool look = subject.look && taken >= count - looks;
      const double begin = CpuMs();
      if (look) {
        hash = (hash ^ subject.look(keyframe)) * 0x9e3779b97f4a7c15;
        look_ms += CpuMs() - begin;
        ++looked;
      } else {
        subject.take(keyframe);
        take_ms += CpuMs() - begin;
      }
    }
    const double now = HeapBytes();
    fmt::print("| {} | {:.1f} | {:.1f} | {:.2f} | {:.3f} | {:.3f} | {:x} |\n", count,
               1e-6 * (now - heap), 1e-6 * (ResidentBytes() - resident),
               1e-3 * (now - last_heap) / (count - first),
               take_ms / std::max(1, count - first - looked), look_ms / std::max(1, looked), hash);
    std::fflush(stdout);
    last_heap = now;
  }
}

}  // namespace
}  // namespace pangea::bench

int main(int argc, char** argv) {
  CLI::App app("What the cores of the server's processes keep of each keyframe",
               "pangea-memory-bench");
  std::string process;
  std::vector<std::string> logs;
  std::vector<int> counts{1000, 4000};
  int looks = 100;
  const auto subjects = pangea::bench::Subjects();
  std::vector<std::string> names;
  for (const auto& [name, make] : subjects) {
    names.push_back(name);
  }
  app.add_option("--process", process, "whose core is measured")
      ->required()
      ->check(CLI::IsMember(names));
  app.add_option("--keyframes", counts, "numbers of keyframes, ascending")->capture_default_str();
  app.add_option("--looks", looks, "of them the last so many are recognised, the others only kept")
      ->capture_default_str();
  app.add_option("logs", logs, "LCM logs with keyframes")->required();
  CLI11_PARSE(app, argc, argv);
  try {
    const pangea::bench::Walk walk(pangea::bench::ReadAll(logs));
    pangea::bench::Measure(walk, subjects.at(process)(), counts, looks);
    return 0;
  } catch (const std::exception& error) {
    fmt::print(stderr, "pangea-memory-bench: {}\n", error.what());
    return 1;
  }
}
