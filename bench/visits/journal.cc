#include "bench/visits/journal.h"

#include <algorithm>
#include <map>
#include <memory>

#include "files/scratch_file.h"

namespace pangea::bench {
namespace {

void ApplyTo(const ThinnedMaps& thinned, const std::vector<Constraint>& derived, Step* step) {
  const auto gone = [&thinned](const KeyframeId& id) { return thinned.gone.contains(id); };
  std::erase_if(step->match.candidates,
                [&](const PlaceCandidate& candidate) { return gone(candidate.match); });
  std::erase_if(step->results, [&](const Constraint& result) {
    return result.kind == PlaceKind::kDerived || gone(result.from);
  });
  step->results.insert(step->results.end(), derived.begin(), derived.end());
  if (const auto edge = thinned.edges.find(step->keyframe.id); edge != thinned.edges.end()) {
    step->keyframe.edge = edge->second.edge;
    step->keyframe.preintegration = edge->second.preintegration;
  }
}

}  // namespace

size_t Journal::num_keyframes() const {
  size_t count = 0;
  for (const auto& entries : maps) {
    count += entries.size();
  }
  return count;
}

size_t Journal::num_accepted() const {
  size_t count = 0;
  for (const auto& entries : maps) {
    for (const Entry& entry : entries) {
      count += std::ranges::count(entry.step.results, true, &Constraint::accepted);
    }
  }
  return count;
}

void Journal::Thin(const Thinning::Options& options, int64_t now_utime) {
  Thinning thinning(options, std::make_shared<ScratchFile>());
  std::map<int64_t, const Constraint*> results;
  for (const auto& entries : maps) {
    for (const Entry& entry : entries) {
      thinning.Take(entry.step.keyframe, entry.journalled_utime);
      for (const Constraint& result : entry.step.results) {
        results.emplace(result.Id(), &result);
      }
    }
  }
  for (const auto& [id, result] : results) {
    thinning.Take(*result);
  }
  const ThinnedMaps thinned = thinning.Thin(now_utime);
  std::map<KeyframeId, std::vector<Constraint>> derived;
  for (const Constraint& constraint : thinned.derived) {
    derived[constraint.to].push_back(constraint);
  }
  for (auto& entries : maps) {
    std::erase_if(
        entries, [&](const Entry& entry) { return thinned.gone.contains(entry.step.keyframe.id); });
    for (Entry& entry : entries) {
      ApplyTo(thinned, derived[entry.step.keyframe.id], &entry.step);
    }
  }
  std::erase_if(maps, [](const auto& entries) { return entries.empty(); });
}

}  // namespace pangea::bench
