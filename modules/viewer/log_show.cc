#include "viewer/log_show.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <set>
#include <stdexcept>
#include <utility>

#include "log_file/log_reader.h"

namespace pangea::viewer {

LogShow::LogShow(const std::string& path, size_t max_solved_poses)
    : source_(std::filesystem::path(path).filename().string()) {
  Read(path);
  if (events_.empty()) {
    throw std::runtime_error(
        fmt::format("{}: holds nothing to show (KEYFRAME_*, MAP_STATE, ...): is it the capture of "
                    "a server bus?",
                    path));
  }
  clock_.live = false;
  clock_.end_s = events_.back().time_s;
  Reset();
  RunTo(clock_.end_s);
  all_fusions_ = scene_->fusions();
  DropUnseenImages();
  ThinStates(max_solved_poses);
  Reset();
}

void LogShow::Read(const std::string& path) {
  SceneEvents parser;
  std::map<AnchorId, AnchorState> anchors;
  // Anchors are published again every ten seconds, for hours, so repeats are left out.
  const auto repeats_anchor = [&anchors](const SceneEvent& event) {
    const auto* state = std::get_if<AnchorState>(&event);
    if (state == nullptr) {
      return false;
    }
    const auto [last, first] = anchors.try_emplace(state->anchor, *state);
    const bool repeats = !first && !ShowsMore(last->second, *state);
    if (!repeats) {
      last->second = *state;
    }
    return repeats;
  };
  std::optional<int64_t> begin;
  double time_s = 0;
  const auto take = [&](const LogEvent& event) {
    begin = begin.value_or(event.utime);
    // The order in the file is right, but a logger's time stamps are not always in order.
    time_s = std::max(time_s, 1e-6 * static_cast<double>(event.utime - *begin));
    SceneEvents::Outcome outcome = parser.Parse(event.channel, event.data);
    num_refused_ += outcome.refused.empty() ? 0 : 1;
    if (outcome.event && !repeats_anchor(*outcome.event)) {
      events_.push_back({time_s, std::move(*outcome.event)});
    }
  };
  ReadLog(path, take, &readings_);
  if (!readings_.at(path).whole()) {
    source_ += " (damaged: not all of it can be read)";
  }
}

// Drops images that do not belong to a keyframe: they are never shown, and are most of an agent's
// log.
void LogShow::DropUnseenImages() {
  std::map<int32_t, std::set<int64_t>> times;  // times of keyframes, by agent
  for (const Timed& timed : events_) {
    if (const auto* keyframe = std::get_if<ShownKeyframe>(&timed.event)) {
      times[keyframe->id.map.agent_id].insert(keyframe->utime);
    }
  }
  std::erase_if(events_, [&times](const Timed& timed) {
    const auto* image = std::get_if<std::shared_ptr<const ShownImage>>(&timed.event);
    if (image == nullptr) {
      return false;
    }
    const std::set<int64_t>& of_agent = times[(*image)->agent_id];
    const auto after = of_agent.lower_bound((*image)->utime - AgentView::kSameTime_us);
    return after == of_agent.end() || *after > (*image)->utime + AgentView::kSameTime_us;
  });
}

void LogShow::ThinStates(size_t max_poses) {
  std::map<MapId, int64_t> newest;  // revision of each group
  for (const Timed& timed : events_) {
    if (const auto* state = std::get_if<MapState>(&timed.event)) {
      newest[state->group] = std::max(newest[state->group], state->revision);
    }
  }
  const auto may_go = [&](const Timed& timed, const MapState& state) {
    return state.revision != newest[state.group] &&
           std::ranges::none_of(all_fusions_,
                                [&](const Fusion& f) { return f.time_s == timed.time_s; });
  };
  bool less = true;
  while (less && NumSolvedPoses() > max_poses) {
    std::map<MapId, std::pair<int64_t, bool>>
        solves;  // by group: newest revision, and whether it is dropped
    less = std::erase_if(events_, [&](const Timed& timed) {
             const auto* state = std::get_if<MapState>(&timed.event);
             if (state == nullptr || !may_go(timed, *state)) {
               return false;
             }
             auto& [revision, goes] = solves[state->group];  // the same for all chunks of a state
             goes = state->revision == revision ? goes : !goes;
             revision = state->revision;
             return goes;
           }) > 0;
  }
}

size_t LogShow::NumSolvedPoses() const {
  size_t poses = 0;
  for (const Timed& timed : events_) {
    const auto* state = std::get_if<MapState>(&timed.event);
    poses += state == nullptr ? 0 : state->keyframes.size();
  }
  return poses;
}

size_t LogShow::NumAnchorStates() const {
  return static_cast<size_t>(std::ranges::count_if(events_, [](const Timed& timed) {
    return std::holds_alternative<AnchorState>(timed.event);
  }));
}

void LogShow::Reset() {
  scene_ = std::make_unique<Scene>();
  ++epoch_;
  next_ = 0;
  clock_.now_s = 0;
}

void LogShow::RunTo(double time_s) {
  for (; next_ < events_.size() && events_[next_].time_s <= time_s; ++next_) {
    scene_->SetTime(events_[next_].time_s);
    std::visit([this](const auto& event) { scene_->Take(event); }, events_[next_].event);
  }
  scene_->SetTime(time_s);
  clock_.now_s = time_s;
}

void LogShow::Advance(double wall_s) {
  if (clock_.playing) {
    RunTo(std::min(clock_.end_s, clock_.now_s + clock_.speed * wall_s));
    clock_.playing = clock_.now_s < clock_.end_s;
  }
}

void LogShow::Seek(double time_s) {
  time_s = std::clamp(time_s, 0.0, clock_.end_s);
  if (time_s < clock_.now_s) {
    Reset();
  }
  RunTo(time_s);
}

void LogShow::Play(bool play) {
  if (play && clock_.now_s >= clock_.end_s) {
    Reset();
  }
  clock_.playing = play;
}

}  // namespace pangea::viewer
