#include "core/group_states.h"

#include <gtest/gtest.h>

namespace pangea {
namespace {

const MapId kA{1, 100}, kB{2, 200};

MapState StateOf(int64_t revision, const std::vector<MapId>& maps, double x) {
  MapState state;
  state.group = maps.front();
  state.revision = revision;
  state.maps = maps;
  for (const MapId& map : maps) {
    KeyframePose& pose = state.keyframes.emplace_back();
    pose.id = {map, 0};
    pose.T_map_body.t.x() = x;
  }
  return state;
}

double XOf(const GroupStates& states, const MapId& map) {
  return states.Find(map)->T_map_body.at({map, 0}).t.x();
}

TEST(GroupStates, TheHighestRevisionOfAMapCountsInAnyOrder) {
  GroupStates states;
  EXPECT_EQ(states.Find(kA), nullptr);
  states.Take(StateOf(7, {kA, kB}, 7.0));
  states.Take(StateOf(3, {kB}, 3.0));
  EXPECT_EQ(states.Find(kB)->id, kA);
  EXPECT_EQ(XOf(states, kB), 7.0);
  states.Take(StateOf(8, {kB}, 8.0));  // taken apart again
  EXPECT_EQ(states.Find(kB)->id, kB);
  EXPECT_EQ(XOf(states, kB), 8.0);
  EXPECT_EQ(XOf(states, kA), 7.0);
}

}  // namespace
}  // namespace pangea
