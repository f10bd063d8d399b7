#include "sim/scene/scene_builder.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "sim/random.h"
#include "sim/scene/furniture.h"
#include "sim/scene/painter.h"
#include "sim/scene/route.h"

namespace pangea::sim {
namespace {

using Eigen::Vector3d;

// Geometry of a scene, without paint.
class Layout {
 public:
  Layout(const SceneOptions& options, const Vector3d& room_min, const Vector3d& room_max,
         std::vector<Vector3d> keep_clear)
      : options_(options), min_(room_min), max_(room_max), keep_clear_(std::move(keep_clear)) {}

  const std::vector<Part>& parts() const { return parts_; }
  double FloorArea() const { return (max_.x() - min_.x()) * (max_.y() - min_.y()); }
  Vector3d min() const { return min_; }
  Vector3d max() const { return max_; }

  // Adds the piece if it is inside the room and clear of the paths.
  bool Place(const Piece& piece, const Vector3d& at, double yaw) {
    const std::vector<Part> placed = Placed(piece, at, yaw);
    if (!std::ranges::all_of(placed, [this](const Part& part) { return Fits(part); })) {
      return false;
    }
    parts_.insert(parts_.end(), placed.begin(), placed.end());
    return true;
  }

 private:
  bool Fits(const Part& part) const {
    const Eigen::Vector3f& p = part.primitive.p_ref;
    for (int axis = 0; axis < 3; ++axis) {
      if (p[axis] < min_[axis] || p[axis] > max_[axis]) {
        return false;
      }
    }
    return std::ranges::all_of(keep_clear_, [&](const Vector3d& point) {
      return part.primitive.Distance(point.cast<float>()) > options_.clearance_m;
    });
  }

  const SceneOptions& options_;
  Vector3d min_, max_;
  std::vector<Vector3d> keep_clear_;
  std::vector<Part> parts_;
};

// Points that the generated paths may reach.
std::vector<Vector3d> RoutePoints(SceneKind kind) {
  const Route route = RouteOf(kind);
  std::vector<Vector3d> points;
  constexpr int kSteps = 240;
  for (int i = 0; i < kSteps; ++i) {
    const Eigen::Vector2d p = route.At(2 * M_PI * i / kSteps);
    for (double z = route.low_m; z <= route.high_m + 1e-9; z += 0.25) {
      for (const double dx : {-route.sideways_m, route.sideways_m}) {
        for (const double dy : {-route.sideways_m, route.sideways_m}) {
          points.emplace_back(p.x() + dx, p.y() + dy, z);
        }
      }
    }
  }
  return points;
}

// Keeps one point per cube of 0.2 m: enough for the clearance, and much faster.
std::vector<Vector3d> Thinned(const std::vector<Vector3d>& points) {
  constexpr double kCell = 0.2;
  std::vector<std::array<int64_t, 3>> cells;
  std::vector<size_t> order(points.size());
  for (size_t i = 0; i < points.size(); ++i) {
    order[i] = i;
    cells.push_back({static_cast<int64_t>(std::floor(points[i].x() / kCell)),
                     static_cast<int64_t>(std::floor(points[i].y() / kCell)),
                     static_cast<int64_t>(std::floor(points[i].z() / kCell))});
  }
  std::ranges::stable_sort(order, [&](size_t a, size_t b) { return cells[a] < cells[b]; });
  const auto same = [&](size_t a, size_t b) { return cells[a] == cells[b]; };
  order.erase(std::unique(order.begin(), order.end(), same), order.end());
  std::vector<Vector3d> thinned;
  for (const size_t i : order) {
    thinned.push_back(points[i]);
  }
  return thinned;
}

void FurnishAlongWalls(Layout* layout, double per_m, bool high, Rng* rng) {
  for (int wall = 0; wall < 4; ++wall) {
    const int along = wall < 2 ? 1 : 0;
    const int across = 1 - along;
    const double length = layout->max()[along] - layout->min()[along];
    const int count = static_cast<int>(per_m * length);
    for (int i = 0; i < count; ++i) {
      const Piece piece = high ? RandomWallPiece(rng) : RandomFloorPiece(rng);
      Vector3d at;
      at[along] = layout->min()[along] + rng->Uniform(0, length);
      const double inset = rng->Uniform(0.1, high ? 0.25 : 0.6);
      at[across] = wall % 2 == 0 ? layout->min()[across] + inset : layout->max()[across] - inset;
      at.z() = layout->min().z();
      if (high) {
        at.z() += rng->Uniform(0.15, 0.85) * (layout->max().z() - layout->min().z());
      }
      layout->Place(piece, at, along == 1 ? M_PI / 2 : 0);
    }
  }
}

void FurnishFloor(Layout* layout, double per_m2, Rng* rng) {
  const int count = static_cast<int>(per_m2 * layout->FloorArea());
  for (int i = 0; i < count; ++i) {
    const Piece piece = RandomFloorPiece(rng);
    for (int attempt = 0; attempt < 6; ++attempt) {
      const Vector3d at(rng->Uniform(layout->min().x(), layout->max().x()),
                        rng->Uniform(layout->min().y(), layout->max().y()), layout->min().z());
      if (layout->Place(piece, at, rng->Uniform(0, 2 * M_PI))) {
        break;
      }
    }
  }
}

void FurnishCeiling(Layout* layout, double per_m2, Rng* rng) {
  const int count = static_cast<int>(per_m2 * layout->FloorArea());
  for (int i = 0; i < count; ++i) {
    const Piece piece = RandomCeilingPiece(rng);
    const Vector3d at(rng->Uniform(layout->min().x(), layout->max().x()),
                      rng->Uniform(layout->min().y(), layout->max().y()),
                      layout->max().z() - rng->Uniform(0.3, 1.2));
    layout->Place(piece, at, M_PI / 2 * rng->Index(2));
  }
}

// Gives the piece its own stream of paint, so that it looks the same wherever it stands.
Piece Shared(Piece piece, int number) {
  for (Part& part : piece) {
    part.paint = fmt::format("shared {} {}", number, &part - piece.data());
  }
  return piece;
}

// Places the dozen objects that both twin rooms have.
void PlaceSharedObjects(Layout* layout, const SceneOptions& options, Rng* rng) {
  Rng shared(options.seed, "shared objects");
  constexpr int kObjects = 12;
  for (int i = 0; i < kObjects; ++i) {
    const Piece piece = Shared(RandomSmallPiece(&shared), i);
    for (int attempt = 0; attempt < 400; ++attempt) {
      const Vector3d at(rng->Uniform(layout->min().x() + 0.3, layout->max().x() - 0.3),
                        rng->Uniform(layout->min().y() + 0.3, layout->max().y() - 0.3),
                        layout->min().z());
      if (layout->Place(piece, at, rng->Uniform(0, 2 * M_PI))) {
        break;
      }
    }
  }
}

// Places two kinds of machine alternately on the whole floor, and one object along all walls, where
// the paths leave room.
void PlaceRows(Layout* layout, const SceneOptions& options) {
  constexpr double kEvery_m = 4;
  constexpr double kInset_m = 1.5;
  constexpr double kWallHeight_m = 2;
  Rng shared(options.seed, "rows");
  const std::array machines = {Shared(RandomFloorPiece(&shared), 0),
                               Shared(RandomFloorPiece(&shared), 1)};
  const Piece on_wall = Shared(RandomWallPiece(&shared), 2);
  const Vector3d low = layout->min() + Vector3d(kInset_m, kInset_m, 0);
  const Vector3d size = layout->max() - low;
  const int columns = static_cast<int>(size.x() / kEvery_m) + 1;
  const int rows = static_cast<int>(size.y() / kEvery_m) + 1;
  for (int i = 0; i < columns; ++i) {
    const double x = low.x() + i * kEvery_m;
    for (int j = 0; j < rows; ++j) {
      const Piece& machine = machines[static_cast<size_t>((i + j) % 2)];
      layout->Place(machine, {x, low.y() + j * kEvery_m, low.z()}, 0);
    }
    for (const double y : {layout->min().y() + 0.2, layout->max().y() - 0.2}) {
      layout->Place(on_wall, {x, y, low.z() + kWallHeight_m}, 0);
    }
  }
  for (int j = 0; j < rows; ++j) {
    for (const double x : {layout->min().x() + 0.2, layout->max().x() - 0.2}) {
      layout->Place(on_wall, {x, low.y() + j * kEvery_m, low.z() + kWallHeight_m}, M_PI / 2);
    }
  }
}

bool HasRows(SceneKind kind) { return kind == SceneKind::kRowsA || kind == SceneKind::kRowsB; }

Layout MakeLayout(const SceneOptions& options, const std::string& stream) {
  Rng rng(options.seed, stream);
  std::vector<Vector3d> keep_clear =
      Thinned(options.keep_clear.empty() ? RoutePoints(options.kind) : options.keep_clear);
  Vector3d low = keep_clear.front();
  Vector3d high = low;
  for (const Vector3d& p : keep_clear) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  const bool hall = IsHall(options.kind);
  const double near = hall ? 3.0 : 1.3;
  const double far = hall ? 5.5 : 2.0;
  for (int axis = 0; axis < 2; ++axis) {
    low[axis] -= rng.Uniform(near, far);
    high[axis] += rng.Uniform(near, far);
  }
  low.z() = options.keep_clear.empty() ? 0 : low.z() - (hall ? 0.9 : 0.6);
  high.z() += hall ? rng.Uniform(2.5, 4.0) : rng.Uniform(0.9, 1.3);

  Layout layout(options, low, high, std::move(keep_clear));
  if (options.kind == SceneKind::kTwinObjectsA || options.kind == SceneKind::kTwinObjectsB) {
    PlaceSharedObjects(&layout, options, &rng);
  }
  if (HasRows(options.kind)) {
    PlaceRows(&layout, options);
    FurnishFloor(&layout, 0.03, &rng);
    return layout;
  }
  FurnishAlongWalls(&layout, hall ? 0.5 : 0.6, false, &rng);
  FurnishAlongWalls(&layout, hall ? 0.6 : 0.9, true, &rng);
  FurnishFloor(&layout, hall ? 0.09 : 0.1, &rng);
  FurnishCeiling(&layout, hall ? 0.05 : 0.1, &rng);
  return layout;
}

std::string StreamOf(SceneKind kind) {
  switch (kind) {
    case SceneKind::kHall:
      return "hall";
    case SceneKind::kRoom:
      return "room";
    case SceneKind::kTwinObjectsA:
      return "twin room a";
    case SceneKind::kTwinObjectsB:
      return "twin room b";
    case SceneKind::kBareHall:
      return "bare hall";
    case SceneKind::kRowsA:
      return "rows a";
    default:
      return "rows b";
  }
}

}  // namespace

Scene BuildScene(const SceneOptions& options) {
  const std::string stream = StreamOf(options.kind);
  const Layout layout = MakeLayout(options, stream);
  Scene scene;
  scene.room_min = layout.min().cast<float>();
  scene.room_max = layout.max().cast<float>();
  Rng rng(options.seed, stream + " light");
  const double azimuth = rng.Uniform(0, 2 * M_PI);
  scene.light =
      Eigen::Vector3d(std::cos(azimuth), std::sin(azimuth), 0.8).normalized().cast<float>();

  SceneClad clad(options.seed, stream, options.coarseness);
  const bool bare = options.kind == SceneKind::kBareHall;
  clad.AddRoom(bare || HasRows(options.kind) ? Marks::kFew : Marks::kMany, &scene);
  for (const Part& part : layout.parts()) {
    clad.AddPart(part, bare ? Marks::kFew : Marks::kMany, &scene);
  }
  clad.Paint(IsHall(options.kind) ? 4096 : 2048, &scene);
  if (options.tags) {
    AddTags(*options.tags, &scene);
  }
  return scene;
}

}  // namespace pangea::sim
