#pragma once

// Which keyframes of maps that show one place stay: those whose view no newer map has.
//
// A view is a viewpoint and what was seen from there. Of each viewpoint the newest maps stay that
// show it: `alike_maps` of one appearance, `maps` of all. So an appearance that no longer comes
// fades as others come, and one that comes again has its newest keyframes. The rule is that of
// lifelong visual maps (Konolige & Bowman, IROS 2009: a neighbourhood of views keeps a bounded
// number of appearances, and gives up the one that was not seen for longest); what is alike is told
// by the check that recognition itself makes.
//
// A keyframe that stays takes those before it along, with which it is verified.

#include <functional>
#include <vector>

#include "core/rigid3.h"

namespace pangea {

struct CoverageOptions {
  // Of one viewpoint: the cameras' distance as a share of the scene's depth, and their angle. Half
  // of what recognition copes with, so that what lies between is recognised.
  double distance_share = 0.2;
  double angle = 0.35;
  int alike_maps = 2;
  int maps = 4;
  int window = 5;  // a keyframe is verified with those before it (kWindowKeyframes)

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
  double depth_m = 0;      // of the scene, the median
  bool must_stay = false;  // whoever else shows it
  // Whether it was ever tied to another map. One that never was is worth no appearance of its own.
  bool recognised = true;
};

struct MapViews {
  int group = 0;            // only maps of one group have a common frame
  std::vector<View> views;  // in the order they were taken
};

struct ViewRef {
  int map = 0;
  int view = 0;
};

// Whether two views are recognised as one place.
using LooksAlike = std::function<bool(const ViewRef&, const ViewRef&)>;

// For each view of each map whether it stays. `newest_first`: the maps.
std::vector<std::vector<bool>> ChooseViews(const std::vector<MapViews>& newest_first,
                                           const LooksAlike& looks_alike,
                                           const CoverageOptions& options);

}  // namespace pangea
