#pragma once

// A small world for the viewer's tests: agents walk on straight lines, with one point per keyframe.

#include "viewer/scene/scene.h"
#include "viewer/show.h"

namespace pangea::viewer {

// The first map of an agent.
MapId TestMap(int32_t agent_id);
inline const MapId kOne = TestMap(1), kTwo = TestMap(2);
constexpr int64_t kSecond = 1'000'000;               // microseconds
constexpr int64_t kStart = 1'700'000'000 * kSecond;  // Unix time, microseconds
// Its x grows by one metre with each seq; it has one point two metres ahead.
ShownKeyframe TestKeyframe(const MapId& map, int32_t seq);
// All keyframes of the maps up to `highest_seq`, each map shifted to y = 10 times its index.
MapState TestState(const std::vector<MapId>& maps, int32_t highest_seq, int64_t revision);
Constraint TestConstraint(const KeyframeId& from, const KeyframeId& to, bool accepted);

// "anchor N", N metres above the origin of the group.
AnchorState TestAnchor(int64_t n, const MapId& group);

// A show that a test controls.
class TestShow : public Show {
 public:
  const Scene& scene() const override { return scene_; }
  int64_t epoch() const override { return epoch_; }
  ShowClock clock() const override { return clock_; }
  std::string source() const override { return "test"; }
  void Seek(double time_s) override { clock_.now_s = time_s; }
  void Play(bool play) override { clock_.playing = play; }
  void SetSpeed(double speed) override { clock_.speed = speed; }

  bool editable() const override { return editable_; }
  void Change(const AnchorChange& change) override { changes_.push_back(change); }

  Scene scene_;
  int64_t epoch_ = 1;
  ShowClock clock_;
  bool editable_ = true;
  std::vector<AnchorChange> changes_;
};

}  // namespace pangea::viewer
