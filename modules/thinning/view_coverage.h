#pragma once

// Chooses which keyframes stay, of several maps that show the same place: those whose view no newer
// map contains.
//
// A view is a viewpoint and its appearance. For each viewpoint the views of the newest maps are
// kept: `alike_maps` maps per appearance, and `maps` maps in total. So an appearance that no longer
// occurs is replaced by others, and a recurring one is represented by its newest keyframes. The
// rule is that of lifelong visual maps (Konolige & Bowman, IROS 2009: a neighbourhood of views
// keeps a bounded number of appearances, and drops the one not seen for longest). Two views have
// the same appearance if place recognition's own check matches them.
//
// With each kept keyframe, its predecessors are kept too, because verification needs them.

#include <functional>
#include <vector>

#include "core/rigid3.h"

namespace pangea {

struct CoverageOptions {
  // Two views have the same viewpoint if the distance of the cameras, relative to the scene's
  // depth, and the angle between them (radians) are below these. They are half of what recognition
  // tolerates, so that views in between are recognised.
  double distance_share = 0.2;
  double angle = 0.35;
  int alike_maps = 2;
  int maps = 4;
  int window = 5;  // keyframes needed to verify one (kWindowKeyframes)

  template <typename Archive>
  void Visit(Archive& archive) {
    archive.Add("distance_share", &distance_share, {0, 10}, "",
                "of the scene's depth, between cameras of one viewpoint");
    archive.Add("angle", &angle, {0, 3.15}, "rad", "between cameras of one viewpoint");
    archive.Add("alike_maps", &alike_maps, {1, 1000}, "",
                "that stay of one viewpoint and one appearance");
    archive.Add("maps", &maps, {1, 1000}, "", "that stay of one viewpoint");
    archive.Add("window", &window, {1, 50}, "keyframes", "that stay at least in a row");
  }
};

struct View {
  Rigid3 T_map_cam;
  double depth_m = 0;      // median depth of the scene
  bool must_stay = false;  // whatever other maps show
  // Whether the view was ever matched with another map. One that never was is not kept as an
  // appearance of its own.
  bool recognised = true;
};

struct MapViews {
  int group = 0;            // only maps of one group have a common frame
  std::vector<View> views;  // in order of time
};

struct ViewRef {
  int map = 0;
  int view = 0;
};

// Whether recognition matches two views.
using LooksAlike = std::function<bool(const ViewRef&, const ViewRef&)>;

// Returns, for each view of each map, whether it stays. `newest_first`: the maps, newest first.
std::vector<std::vector<bool>> ChooseViews(const std::vector<MapViews>& newest_first,
                                           const LooksAlike& looks_alike,
                                           const CoverageOptions& options);

}  // namespace pangea
