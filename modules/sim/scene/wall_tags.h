#pragma once

// Hangs AprilTags on the walls of a scene.

#include "sim/scene/scene.h"

namespace pangea::sim {

struct WallTags {
  int first_id = 0;       // of family 36h11; each tag has the next id
  double size_m = 0.3;    // side of the black square
  double every_m = 1.5;   // along each wall
  double height_m = 2.4;  // above most things
};

// The scene is otherwise the same. Things that stand before a wall may hide a tag.
void AddTags(const WallTags& tags, Scene* scene);

}  // namespace pangea::sim
