#include "viewer/log_show.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <set>
#include <stdexcept>
#include <utility>

#include "common/bus/log_reader.h"

namespace pangea::viewer {

LogShow::LogShow(const std::string& path)
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
  ThinStates();
  Reset();
}

void LogShow::Read(const std::string& path) {
  SceneEvents parser;
  std::optional<int64_t> begin;
  double time_s = 0;
  ReadLog(path, [&](const LogEvent& event) {
    begin = begin.value_or(event.utime);
    // A logger's stamps are not always in order; the file is.
    time_s = std::max(time_s, 1e-6 * static_cast<double>(event.utime - *begin));
    SceneEvents::Outcome outcome = parser.Parse(event.channel, event.data);
    num_refused_ += outcome.refused.empty() ? 0 : 1;
    if (outcome.event) {
      events_.push_back({time_s, std::move(*outcome.event)});
    }
  });
}

// Only images of keyframes are shown; the others are most of what an agent's log holds.
void LogShow::DropUnseenImages() {
  std::map<int32_t, std::set<int64_t>> times;  // of keyframes, by agent
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

void LogShow::ThinStates() {
  const auto poses_of = [](const Timed& timed) {
    const auto* state = std::get_if<MapState>(&timed.event);
    return state == nullptr ? size_t{0} : state->keyframes.size();
  };
  const auto changes_groups = [&](const Timed& timed) {
    return std::ranges::any_of(all_fusions_,
                               [&](const Fusion& f) { return f.time_s == timed.time_s; });
  };
  for (;;) {
    size_t poses = 0;
    for (const Timed& timed : events_) {
      poses += poses_of(timed);
    }
    if (poses <= kMaxSolvedPoses) {
      return;
    }
    bool drop = false;
    const size_t before = events_.size();
    std::erase_if(events_, [&](const Timed& timed) {
      const bool may_go = poses_of(timed) > 0 && &timed != &events_.back();
      drop = may_go ? !drop : drop;
      return may_go && drop && !changes_groups(timed);
    });
    if (events_.size() == before) {
      return;
    }
  }
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
