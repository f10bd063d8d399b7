#include "bench/visits/server.h"

#include <algorithm>
#include <utility>

#include "files/scratch_file.h"

namespace pangea::bench {

size_t Journal::num_accepted() const {
  return std::ranges::count_if(constraints, [](const auto& item) { return item.second.accepted; });
}

size_t Journal::num_keyframes() const {
  size_t count = 0;
  for (const auto& entries : maps) {
    count += entries.size();
  }
  return count;
}

ThinnedMaps Journal::Thin(const Thinning::Options& options, int64_t now_utime) {
  Thinning thinning(options, std::make_shared<ScratchFile>());
  for (const auto& entries : maps) {
    for (const Entry& entry : entries) {
      thinning.Take(entry.keyframe, entry.journalled_utime);
    }
  }
  for (const auto& [id, constraint] : constraints) {
    thinning.Take(constraint);
  }
  ThinnedMaps thinned = thinning.Thin(now_utime);
  const auto gone = [&thinned](const KeyframeId& id) { return thinned.gone.contains(id); };
  for (auto& entries : maps) {
    std::erase_if(entries, [&](const Entry& entry) { return gone(entry.keyframe.id); });
    for (Entry& entry : entries) {
      std::erase_if(entry.match.candidates,
                    [&](const PlaceCandidate& candidate) { return gone(candidate.match); });
      if (const auto edge = thinned.edges.find(entry.keyframe.id); edge != thinned.edges.end()) {
        entry.keyframe.edge = edge->second.edge;
        entry.keyframe.preintegration = edge->second.preintegration;
      }
    }
  }
  std::erase_if(maps, [](const auto& entries) { return entries.empty(); });
  std::erase_if(constraints, [&](const auto& item) {
    const auto& [id, constraint] = item;
    return constraint.kind == PlaceKind::kDerived || gone(constraint.from) || gone(constraint.to);
  });
  for (const Constraint& constraint : thinned.derived) {
    constraints.emplace(constraint.Id(), constraint);
  }
  return thinned;
}

Server::Server(const Journal& journal) {
  const auto records = std::make_shared<ScratchFile>();
  use_.Measure("place_recognition", [&] {
    recognition_ = std::make_unique<PlaceRecognition>(PlaceRecognitionOptions{}, records);
    for (const auto& entries : journal.maps) {
      for (const Journal::Entry& entry : entries) {
        recognition_->Remember(entry.keyframe, entry.match);
      }
    }
  });
  const auto all = [&journal](auto* core) {
    for (const auto& entries : journal.maps) {
      for (const Journal::Entry& entry : entries) {
        core->Add(entry.keyframe);
      }
    }
  };
  use_.Measure("inter_map_ba", [&] {
    inter_map_ba_ = std::make_unique<LoopVerifier>(LoopVerifierOptions{}, records);
    all(inter_map_ba_.get());
  });
  use_.Measure("fusion", [&] {
    fusion_ = std::make_unique<LoopVerifier>(LoopVerifierOptions{}, records);
    all(fusion_.get());
  });
  use_.Measure("posegraph", [&] {
    graph_ = std::make_unique<PoseGraph>(PoseGraphOptions{});
    for (const auto& entries : journal.maps) {
      for (const Journal::Entry& entry : entries) {
        graph_->AddKeyframe(entry.keyframe);
      }
    }
    for (const auto& [id, constraint] : journal.constraints) {
      graph_->AddConstraint(constraint);
    }
  });
  Finish();
}

void Server::Finish() {
  TellGroups(use_.Measure("posegraph", [&] { return graph_->Finish(); }));
}

void Server::TellGroups(const PoseGraphUpdate& update) {
  for (const MapState& state : update.states) {
    recognition_->Take(state);
  }
}

Constraint Server::Verify(const KeyframeId& query, const PlaceCandidate& candidate) {
  if (candidate.kind == PlaceKind::kIntra) {
    return use_.Measure("inter_map_ba", [&] { return inter_map_ba_->Verify(query, candidate); });
  }
  return use_.Measure("fusion", [&] { return fusion_->Verify(query, candidate); });
}

std::vector<Constraint> Server::Take(const Keyframe& keyframe, Journal* journal) {
  const PlaceMatch match =
      use_.Measure("place_recognition", [&] { return recognition_->Add(keyframe); });
  use_.Measure("inter_map_ba", [&] { inter_map_ba_->Add(keyframe); });
  use_.Measure("fusion", [&] { fusion_->Add(keyframe); });
  use_.Measure("posegraph", [&] { graph_->AddKeyframe(keyframe); });
  if (keyframe.id.seq == 0) {
    journal->maps.emplace_back();
  }
  journal->maps.back().push_back({keyframe, match, keyframe.id.map.opened_utime});
  std::vector<Constraint> results;
  for (const PlaceCandidate& candidate : match.candidates) {
    results.push_back(Verify(keyframe.id, candidate));
    journal->constraints.try_emplace(results.back().Id(), results.back());
    use_.Measure("posegraph", [&] { graph_->AddConstraint(results.back()); });
  }
  TellGroups(use_.Measure("posegraph", [&] { return graph_->Update(); }));
  return results;
}

}  // namespace pangea::bench
