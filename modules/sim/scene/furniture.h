#pragma once

// Pieces of furniture, assembled from boxes and cylinders, and their paint.

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <string>
#include <vector>

#include "sim/random.h"
#include "sim/scene/painter.h"
#include "sim/scene/scene.h"

namespace pangea::sim {

// A primitive of a piece; until placed, in the piece's own frame (standing on z = 0).
struct Part {
  Primitive primitive;
  std::string paint;  // random stream of its paint; empty: by its position in the scene
};
using Piece = std::vector<Part>;

Piece RandomFloorPiece(Rng* rng);    // cabinets, tanks, machines, pipes, crates
Piece RandomSmallPiece(Rng* rng);    // fits into a cube of 0.8 m
Piece RandomWallPiece(Rng* rng);     // boxes and pipes along x
Piece RandomCeilingPiece(Rng* rng);  // ducts and beams along x

// The piece, rotated about z and moved to `at`.
std::vector<Part> Placed(const Piece& piece, const Eigen::Vector3d& at, double yaw);

enum class Marks { kMany, kFew };  // kFew: bare white walls

// Assigns a painted sheet to every face: first sizes and random streams, then all are painted in
// parallel.
class SceneClad {
 public:
  SceneClad(uint64_t seed, std::string stream, double coarseness)
      : seed_(seed), stream_(std::move(stream)), coarseness_(coarseness) {}

  void AddRoom(Marks marks, Scene* scene);
  void AddPart(const Part& part, Marks marks, Scene* scene);
  void Paint(int detail_size, Scene* scene);

 private:
  struct Order {
    std::string paint;
    double width_m, height_m, texel_m;
    SheetStyle style;
    Marks marks;
  };
  int AddSheet(const std::string& paint, const Eigen::Vector2d& size_m, double texel_m,
               Marks marks);

  uint64_t seed_;
  std::string stream_;
  double coarseness_;
  std::vector<Order> orders_;
};

}  // namespace pangea::sim
