#include "bench/cores/cores.h"

#include <algorithm>
#include <utility>

#include "files/scratch_file.h"

namespace pangea::bench {

Cores::Cores(bool recognition_alone, const GlobalBaOptions& global_ba)
    : recognition_alone_(recognition_alone) {
  const auto records = std::make_shared<ScratchFile>();
  use_.Measure("place_recognition", [&] {
    recognition_ = std::make_unique<PlaceRecognition>(PlaceRecognitionOptions{}, records);
  });
  inter_map_ba_ = std::make_unique<LoopVerifier>(LoopVerifierOptions{}, records);
  fusion_ = std::make_unique<LoopVerifier>(LoopVerifierOptions{}, records);
  graph_ = std::make_unique<PoseGraph>(PoseGraphOptions{});
  global_ba_ = std::make_unique<GlobalBa>(global_ba, records);
  map_points_ = std::make_unique<MapPoints>(records);
}

void Cores::Remember(const Step& step) {
  const Keyframe& keyframe = step.keyframe;
  use_.Measure("place_recognition", [&] { recognition_->Remember(keyframe, step.match); });
  if (recognition_alone_) {
    return;
  }
  const auto verifier = [&](LoopVerifier* core, PlaceKind kind) {
    core->Add(keyframe);
    for (const Constraint& result : step.results) {
      if (result.kind == kind) {
        core->NoteVerified(result);
      }
    }
  };
  use_.Measure("inter_map_ba", [&] { verifier(inter_map_ba_.get(), PlaceKind::kIntra); });
  use_.Measure("fusion", [&] { verifier(fusion_.get(), PlaceKind::kInter); });
  use_.Measure("posegraph", [&] {
    graph_->AddKeyframe(keyframe);
    for (const Constraint& result : step.results) {
      graph_->AddConstraint(result);
    }
  });
  use_.Measure("global_ba", [&] {
    global_ba_->Take(step.match);
    global_ba_->Take(keyframe);
    for (const Constraint& result : step.results) {
      global_ba_->Take(result);
    }
  });
  use_.Measure("map_points", [&] { map_points_->Take(keyframe); });
}

void Cores::Start(bool adjust) {
  if (recognition_alone_) {
    return;
  }
  const PoseGraphUpdate update = use_.Measure("posegraph", [&] { return graph_->Finish(); });
  started_ = adjust;
  Tell(update);
  if (adjust) {
    AdjustDue();
  }
  use_.Measure("map_points", [&] {
    for (const MapState& state : update.states) {
      map_points_->TakeRefined(state);
    }
  });
  started_ = true;
}

void Cores::Tell(const PoseGraphUpdate& update) {
  for (const Correction& correction : update.corrections) {
    T_map_odom_[correction.map] = correction.T_map_odom;
  }
  for (const MapState& state : update.states) {
    states_.Take(state);
    use_.Measure("place_recognition", [&] { recognition_->Take(state); });
    use_.Measure("map_points", [&] { map_points_->Take(state); });
    // The groups of Start were adjusted long ago.
    if (started_) {
      use_.Measure("global_ba", [&] { global_ba_->Take(state); });
    }
  }
}

Constraint Cores::Verify(const KeyframeId& query, const PlaceCandidate& candidate) {
  if (candidate.kind == PlaceKind::kIntra) {
    return use_.Measure("inter_map_ba", [&] { return inter_map_ba_->Verify(query, candidate); });
  }
  return use_.Measure("fusion", [&] { return fusion_->Verify(query, candidate); });
}

Step Cores::Take(const Keyframe& keyframe) {
  const PlaceMatch match =
      use_.Measure("place_recognition", [&] { return recognition_->Add(keyframe); });
  if (recognition_alone_) {
    return {keyframe, match, {}};
  }
  use_.Measure("inter_map_ba", [&] { inter_map_ba_->Add(keyframe); });
  use_.Measure("fusion", [&] { fusion_->Add(keyframe); });
  use_.Measure("global_ba", [&] {
    global_ba_->Take(keyframe);
    global_ba_->Take(match);
  });
  use_.Measure("map_points", [&] { map_points_->Take(keyframe); });
  std::vector<Constraint> results;
  for (const PlaceCandidate& candidate : match.candidates) {
    results.push_back(Verify(keyframe.id, candidate));
    use_.Measure("global_ba", [&] { global_ba_->Take(results.back()); });
  }
  const double begin_ms = CpuMs();
  const PoseGraphUpdate update = use_.Measure("posegraph", [&] {
    graph_->AddKeyframe(keyframe);
    for (const Constraint& result : results) {
      graph_->AddConstraint(result);
    }
    return graph_->Update();
  });
  longest_solve_ms_ = std::max(longest_solve_ms_, CpuMs() - begin_ms);
  Tell(update);
  SendPoints(keyframe);
  return {keyframe, match, results};
}

void Cores::SendPoints(const Keyframe& keyframe) {
  if (const auto corrected = T_map_odom_.find(keyframe.id.map); corrected != T_map_odom_.end()) {
    const Rigid3& T_map_odom = corrected->second;
    use_.Measure("map_points", [&] {
      return map_points_->Choose({keyframe.id.map, T_map_odom * keyframe.T_odom_body,
                                  T_map_odom.q * keyframe.v_odom_body});
    });
  }
}

void Cores::Quiet() {
  if (recognition_alone_) {
    return;
  }
  Tell(use_.Measure("posegraph", [&] { return graph_->Finish(); }));
  AdjustDue();
}

void Cores::AdjustDue() {
  while (global_ba_->HasWork()) {
    const auto refined = use_.Measure("global_ba", [&] { return global_ba_->Advance(); });
    if (refined) {
      use_.Measure("map_points", [&] { map_points_->TakeRefined(*refined); });
      Tell(use_.Measure("posegraph", [&] {
        graph_->AddRefinement(*refined);
        return graph_->Update();
      }));
    }
  }
}

}  // namespace pangea::bench
