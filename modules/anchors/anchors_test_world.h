#pragma once

// For tests: two agents of the synthetic world, whose keyframes were given to `anchors_`.

#include <gtest/gtest.h>

#include <vector>

#include "anchors/anchors.h"
#include "core/testing/synthetic_world.h"

namespace pangea {

class AnchorsTestWorld : public testing::Test {
 protected:
  explicit AnchorsTestWorld(bool with_corners = false) : anchors_(AnchorsOptions()) {
    SyntheticWorldOptions options;
    options.num_keyframes = 20;
    options.with_corners = with_corners;
    world_ = MakeSyntheticWorld(options);
    for (const SyntheticAgent& agent : world_.agents) {
      for (const Keyframe& keyframe : agent.keyframes) {
        anchors_.Take(keyframe);
      }
    }
  }

  const MapId& map(int agent) const { return world_.agents[agent].map; }

  // The true state of a group of these agents, displaced by T.
  MapState State(const std::vector<int>& agents, int64_t revision, const Rigid3& T = {}) const {
    MapState state;
    state.group = map(agents[0]);
    state.revision = revision;
    for (const int agent : agents) {
      state.maps.push_back(map(agent));
      for (const Keyframe& keyframe : world_.agents[agent].keyframes) {
        state.keyframes.push_back(
            {keyframe.id, keyframe.utime, T * world_.T_hall_body(keyframe.id)});
      }
    }
    return state;
  }
  void Fuse() { anchors_.Take(State({0, 1}, 1)); }

  SyntheticWorld world_;
  Anchors anchors_;
};

}  // namespace pangea
