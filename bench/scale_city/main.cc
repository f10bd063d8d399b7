// Measures the cost of a keyframe for the server's cores in a city of many keyframes, and how well
// an agent finds its hall. Prints one line of JSON.
//
// The city (city.h) is loaded as from a journal. Then agents come one after another, each into
// another hall; the metrics are for them.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "bench/cores/cores.h"
#include "bench/scale_city/city.h"
#include "blas/blas.h"
#include "eval/metrics.h"
#include "messages/channels.h"
#include "messages/encoding.h"
#include "messages/messages.h"
#include "site/journal_writer.h"

namespace pangea::bench {
namespace {

struct Arguments {
  std::string log, journal;
  int64_t keyframes = 1000;
  int visits = 4, agents = 4;
  bool recognition_alone = false;
  CityOptions city;
  GlobalBaOptions global_ba;
};

void Write(const Step& step, site::JournalWriter* journal) {
  const KeyframeId& id = step.keyframe.id;
  const int64_t utime = id.map.opened_utime;
  journal->Write(utime, channels::Keyframe(id.map.agent_id),
                 EncodeMessage(ToMessage(step.keyframe)));
  journal->Write(utime, std::string(channels::kPlaceMatch), EncodeMessage(ToMessage(step.match)));
  for (const Constraint& result : step.results) {
    journal->Write(utime, std::string(channels::kConstraint), EncodeMessage(ToMessage(result)));
  }
}

class Bench {
 public:
  explicit Bench(const Arguments& arguments)
      : arguments_(arguments),
        city_(arguments.log, arguments.city),
        cores_(arguments.recognition_alone, arguments.global_ba) {}

  nlohmann::json Run() {
    const int a_hall = arguments_.visits * city_.keyframes_a_visit();
    const auto halls = static_cast<int>((arguments_.keyframes + a_hall - 1) / a_hall);
    nlohmann::json out{{"halls", halls}, {"keyframes", int64_t{halls} * a_hall}};
    Remember(halls);
    for (const auto& [process, use] : cores_.TakeUse()) {
      out["processes"][process] = {
          {"kept_kb_a_keyframe", 1e-3 * use.heap_bytes / (int64_t{halls} * a_hall)},
          {"known_ms_a_keyframe", use.cpu_ms / (int64_t{halls} * a_hall)}};
    }
    // The same halls for every size of the city; two of them are alike.
    for (int hall = 0; hall < std::min(arguments_.agents, halls); ++hall) {
      out["agents"].push_back(Come(hall));
    }
    for (const auto& [process, use] : cores_.TakeUse()) {
      out["processes"][process]["ms_a_keyframe"] = use.cpu_ms / num_new_;
      out["processes"][process]["heap_mb"] = 1e-6 * use.heap_bytes;
    }
    out["longest_solve_ms"] = cores_.TakeLongestSolve_ms();
    return out;
  }

 private:
  void Remember(int halls) {
    std::unique_ptr<site::JournalWriter> journal;
    if (!arguments_.journal.empty()) {
      journal = std::make_unique<site::JournalWriter>(arguments_.journal);
    }
    for (int visit = 0; visit < arguments_.visits; ++visit) {
      for (int hall = 0; hall < halls; ++hall) {
        for (const Step& step : city_.Visit(hall, visit)) {
          cores_.Remember(step);
          if (journal != nullptr) {
            Write(step, journal.get());
          }
        }
      }
    }
    if (journal != nullptr) {
      journal->Finish();
    }
    cores_.Start(arguments_.city.joined);
  }

  nlohmann::json Come(int hall) {
    int accepted = 0, refused = 0, wrong = 0, keyframes = 0, fused_after = -1;
    MapId map;
    for (const Keyframe& keyframe : city_.Walk(hall, arguments_.visits)) {
      map = keyframe.id.map;
      ++keyframes;
      const Step step = cores_.Take(keyframe);
      for (const Constraint& result : step.results) {
        ++(result.accepted ? accepted : refused);
        wrong += city_.IsWrong(result) ? 1 : 0;
      }
      const MapState* state = cores_.StateOf(map);
      if (fused_after < 0 && state != nullptr && state->maps.size() > 1) {
        fused_after = keyframes;
      }
    }
    cores_.Quiet();
    num_new_ += keyframes;
    return {{"hall", hall},
            {"model", city_.ModelOf(hall).value_or(-1)},
            {"accepted", accepted},
            {"refused", refused},
            {"wrong", wrong},
            {"fused_after", fused_after},
            {"other_halls", NumOtherHalls(map)},
            {"joint_ate_m", JointAte(map)}};
  }

  // Number of other halls in the map's group.
  int NumOtherHalls(const MapId& map) const {
    std::set<int> halls{city_.HallOf(map)};
    if (const MapState* state = cores_.StateOf(map)) {
      for (const MapId& other : state->maps) {
        halls.insert(city_.HallOf(other));
      }
    }
    return static_cast<int>(halls.size()) - 1;
  }

  // Joint ATE of the hall's maps.
  double JointAte(const MapId& map) const {
    const MapState* state = cores_.StateOf(map);
    std::map<MapId, std::vector<PosePair>> pairs;
    for (size_t i = 0; state != nullptr && i < state->keyframes.size(); ++i) {
      const auto& [id, utime, T_map_body] = state->keyframes[i];
      if (city_.HallOf(id.map) == city_.HallOf(map)) {
        pairs[id.map].push_back({utime, T_map_body, city_.Truth(id)});
      }
    }
    std::vector<std::vector<PosePair>> maps;
    for (auto& [id, of_map] : pairs) {
      maps.push_back(std::move(of_map));
    }
    const auto joint = JointAbsoluteError(maps, TrajectoryAlignmentKind::kYaw);
    return joint ? joint->position_m.rmse : -1;
  }

  Arguments arguments_;
  City city_;
  Cores cores_;
  int64_t num_new_ = 0;
};

}  // namespace
}  // namespace pangea::bench

int main(int argc, char** argv) {
  CLI::App app("What a keyframe costs the server in a city of so many", "pangea-scale-bench");
  pangea::bench::Arguments arguments;
  app.add_option("log", arguments.log, "LCM log of one hall: keyframes, matches, results")
      ->required();
  app.add_option("--keyframes", arguments.keyframes, "of the city, at least")
      ->capture_default_str();
  app.add_option("--visits", arguments.visits, "of each hall")->capture_default_str();
  app.add_option("--agents", arguments.agents, "that come then, each into another hall")
      ->capture_default_str();
  app.add_option("--alike-every", arguments.city.alike_every,
                 "of so many halls one looks like another; 0: none")
      ->capture_default_str();
  app.add_option("--alike-cells", arguments.city.alike_cells,
                 "one of so many cells of that hall looks so")
      ->capture_default_str();
  app.add_flag("--joined", arguments.city.joined, "all halls are one group");
  app.add_option("--whole-keyframes", arguments.global_ba.local.keyframes,
                 "of the largest group that global_ba always adjusts as a whole")
      ->capture_default_str();
  app.add_option("--neighbours", arguments.global_ba.local.max_neighbours,
                 "that global_ba moves beside what is new in a larger one")
      ->capture_default_str();
  app.add_flag("--recognition-alone", arguments.recognition_alone, "the other cores get nothing");
  app.add_option("--journal", arguments.journal, "the city as a journal, to be made");
  CLI11_PARSE(app, argc, argv);
  fmt::print(stderr, "{}\n", pangea::ToString(pangea::LoadedBlas()));
  try {
    fmt::print("{}\n", pangea::bench::Bench(arguments).Run().dump());
    return 0;
  } catch (const std::exception& error) {
    fmt::print(stderr, "pangea-scale-bench: {}\n", error.what());
    return 1;
  }
}
