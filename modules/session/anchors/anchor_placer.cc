#include "session/anchors/anchor_placer.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace pangea::session {
namespace {

constexpr int64_t kRepeat_us = 1'000'000;

}  // namespace

AnchorPlacer::AnchorPlacer(std::vector<PlannedAnchor> anchors) {
  for (PlannedAnchor& planned : anchors) {
    tasks_.emplace_back().planned = std::move(planned);
  }
}

void AnchorPlacer::OnPose(int32_t agent, int64_t utime, const std::optional<MapId>& map,
                          int64_t now_us) {
  if (!map) {
    tracked_.erase(agent);
    return;
  }
  Tracked& tracked = tracked_.try_emplace(agent, Tracked{*map, utime}).first->second;
  if (tracked.map != *map) {
    tracked = {*map, utime};
  }
  for (Task& task : tasks_) {
    if (task.planned.script.agent == agent && !task.request && utime >= task.planned.image_utime) {
      Request(tracked, now_us, &task);
    }
  }
}

// If the odometry did not track the image, use the first one that it tracked.
void AnchorPlacer::Request(const Tracked& tracked, int64_t now_us, Task* task) {
  const AnchorScript& script = task->planned.script;
  last_created_ = std::max(now_us, last_created_ + 1);
  AnchorEdit& edit = task->request.emplace();
  edit.anchor = {script.agent, last_created_};
  edit.agent_id = script.agent;
  edit.name = script.name;
  edit.payload = script.payload;
  edit.placement = AnchorEdit::Placement::kPixel;
  edit.map = tracked.map;
  edit.utime = std::max(task->planned.image_utime, tracked.since_utime);
  edit.pixel = script.pixel;
  task->due_us = now_us;
}

void AnchorPlacer::OnAnchor(int32_t agent, const AnchorId& anchor, int64_t revision) {
  for (Task& task : tasks_) {
    if (task.request && task.request->anchor == anchor && task.request->agent_id == agent &&
        revision >= task.request->revision) {
      task.heard = true;
    }
  }
}

std::vector<AnchorEdit> AnchorPlacer::TakeDue(int64_t now_us) {
  std::vector<AnchorEdit> due;
  for (Task& task : tasks_) {
    if (task.request && !task.heard && now_us >= task.due_us) {
      due.push_back(*task.request);
      task.due_us = now_us + kRepeat_us;
    }
  }
  return due;
}

std::vector<std::string> AnchorPlacer::NotPlaced() const {
  std::vector<std::string> lines;
  for (const Task& task : tasks_) {
    const AnchorScript& script = task.planned.script;
    if (!task.heard) {
      lines.push_back(fmt::format(
          "agent {}: anchor {} was never placed: {}", script.agent, script.name,
          task.request
              ? "it was requested, and the agent heard of none"
              : fmt::format("the odometry did not track at {:g} s or later", script.at_s)));
    }
  }
  return lines;
}

}  // namespace pangea::session
