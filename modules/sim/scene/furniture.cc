#include "sim/scene/furniture.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <thread>
#include <utility>

namespace pangea::sim {
namespace {

using Eigen::Vector3d;

Part Box(const Vector3d& centre, const Vector3d& size, double yaw = 0) {
  Part part;
  part.primitive.kind = Primitive::Kind::kBox;
  part.primitive.p_ref = centre.cast<float>();
  part.primitive.half = (0.5 * size).cast<float>();
  part.primitive.R_local_ref =
      Eigen::AngleAxisd(-yaw, Vector3d::UnitZ()).toRotationMatrix().cast<float>();
  return part;
}

// `axis` is 0, 1 or 2: along x, y or z.
Part Cylinder(const Vector3d& centre, double radius, double length, int axis) {
  Part part;
  part.primitive.kind = Primitive::Kind::kCylinder;
  part.primitive.p_ref = centre.cast<float>();
  part.primitive.half = Vector3d(radius, radius, 0.5 * length).cast<float>();
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();  // rows: the local axes
  if (axis == 0) {
    R << 0, 1, 0, 0, 0, 1, 1, 0, 0;
  } else if (axis == 1) {
    R << 0, 0, 1, 1, 0, 0, 0, 1, 0;
  }
  part.primitive.R_local_ref = R.cast<float>();
  return part;
}

Vector3d RandomSize(Rng* rng, const Vector3d& low, const Vector3d& high) {
  Vector3d size;
  for (int i = 0; i < 3; ++i) {
    size[i] = rng->Uniform(low[i], high[i]);
  }
  return size;
}

Piece Cabinet(Rng* rng) {
  const Vector3d size = RandomSize(rng, {0.5, 0.4, 0.8}, {1.8, 0.9, 2.4});
  const Vector3d top = RandomSize(rng, {0.2, 0.2, 0.1}, {0.5, 0.4, 0.5});
  return {Box({0, 0, 0.5 * size.z()}, size),
          Box({rng->Uniform(-0.2, 0.2), 0, size.z() + 0.5 * top.z()}, top, rng->Uniform(-1, 1))};
}

Piece Tank(Rng* rng) {
  const double radius = rng->Uniform(0.25, 0.9);
  const double height = rng->Uniform(0.8, 3.0);
  const double pipe = rng->Uniform(0.04, 0.12);
  const double foot = rng->Uniform(0.1, 0.3);
  return {Box({0, 0, 0.5 * foot}, {2.1 * radius, 2.1 * radius, foot}),
          Cylinder({0, 0, foot + 0.5 * height}, radius, height, 2),
          Cylinder({0.5 * radius, 0, foot + height + 0.5}, pipe, 1.0, 2)};
}

Piece Machine(Rng* rng) {
  const Vector3d size = RandomSize(rng, {1.0, 0.7, 0.6}, {2.6, 1.6, 1.6});
  Piece piece{Box({0, 0, 0.5 * size.z()}, size)};
  for (int i = 2 + rng->Index(3); i > 0; --i) {
    const Vector3d block = RandomSize(rng, {0.2, 0.2, 0.15}, {0.8, 0.7, 0.9});
    const double x = rng->Uniform(-0.5, 0.5) * size.x();
    piece.push_back(Box({x, 0.3 * (rng->Uniform() - 0.5) * size.y(), size.z() + 0.5 * block.z()},
                        block, rng->Chance(0.3) ? rng->Uniform(-0.5, 0.5) : 0));
  }
  const double radius = rng->Uniform(0.08, 0.25);
  piece.push_back(Cylinder({0, 0.5 * size.y() + radius, rng->Uniform(0.3, 0.8) * size.z()}, radius,
                           size.x() * rng->Uniform(0.6, 1.3), 0));
  return piece;
}

Piece PipeBundle(Rng* rng) {
  Piece piece;
  const double length = rng->Uniform(1.5, 3.0);
  double y = 0;
  for (int i = 2 + rng->Index(3); i > 0; --i) {
    const double radius = rng->Uniform(0.05, 0.2);
    y += radius;
    piece.push_back(
        Cylinder({rng->Uniform(-0.3, 0.3), y, rng->Uniform(0.3, 1.4)}, radius, length, 0));
    y += radius + 0.05;
  }
  for (const double x : {-0.4 * length, 0.4 * length}) {
    piece.push_back(Box({x, 0.5 * y, 0.45}, {0.08, 0.08, 0.9}));
  }
  return piece;
}

Piece Crates(Rng* rng) {
  Piece piece;
  double z = 0;
  for (int i = 2 + rng->Index(3); i > 0; --i) {
    const Vector3d size = RandomSize(rng, {0.4, 0.4, 0.25}, {1.0, 0.9, 0.7});
    piece.push_back(
        Box({rng->Uniform(-0.1, 0.1), 0, z + 0.5 * size.z()}, size, rng->Uniform(-0.4, 0.4)));
    z += size.z();
  }
  return piece;
}

Piece Column(Rng* rng) {
  Piece piece;
  const double width = rng->Uniform(0.25, 0.5);
  constexpr double kSegment = 2.0;
  for (int i = 0; i < 3; ++i) {
    piece.push_back(Box({0, 0, (i + 0.5) * kSegment}, {width, width, kSegment}));
  }
  return piece;
}

// Size of the sheet of a part's face, along u and v.
Eigen::Vector2d SheetSize(const Primitive& primitive, int face) {
  const Vector3d size = 2 * primitive.half.cast<double>();
  if (primitive.kind == Primitive::Kind::kCylinder) {
    return face == 0 ? Eigen::Vector2d(M_PI * size.x(), size.z())
                     : Eigen::Vector2d(size.x(), size.x());
  }
  constexpr int kAxes[3][2] = {{1, 2}, {0, 2}, {0, 1}};
  return {size[kAxes[face / 2][0]], size[kAxes[face / 2][1]]};
}

}  // namespace

Piece RandomFloorPiece(Rng* rng) {
  switch (rng->Index(7)) {
    case 0:
      return Cabinet(rng);
    case 1:
      return Tank(rng);
    case 2:
    case 3:
      return Machine(rng);
    case 4:
      return PipeBundle(rng);
    case 5:
      return Column(rng);
    default:
      return Crates(rng);
  }
}

Piece RandomSmallPiece(Rng* rng) {
  const Vector3d size = RandomSize(rng, {0.25, 0.25, 0.25}, {0.5, 0.5, 0.6});
  const double radius = rng->Uniform(0.08, 0.2);
  return {Box({0, 0, 0.5 * size.z()}, size, rng->Uniform(0, 1)),
          Cylinder({0, 0, size.z() + 0.15}, radius, 0.3, 2)};
}

Piece RandomWallPiece(Rng* rng) {
  if (rng->Chance(0.5)) {
    Piece piece;
    const double radius = rng->Uniform(0.05, 0.3);
    constexpr double kSegment = 2.5;
    for (int i = 0; i < 2 + rng->Index(3); ++i) {
      piece.push_back(Cylinder({(i + 0.5) * kSegment, 0, 0}, radius, kSegment - 0.02, 0));
      piece.push_back(Cylinder({i * kSegment, 0, 0}, 1.25 * radius, 0.08, 0));
    }
    return piece;
  }
  const Vector3d size = RandomSize(rng, {0.3, 0.15, 0.3}, {1.6, 0.4, 1.2});
  return {Box({0, 0, 0}, size), Box({0, 0, 0.6 * size.z()}, 0.5 * size)};
}

Piece RandomCeilingPiece(Rng* rng) {
  Piece piece;
  constexpr double kSegment = 2.5;
  const bool duct = rng->Chance(0.6);
  const double width = rng->Uniform(0.2, 0.7);
  for (int i = 0; i < 2 + rng->Index(4); ++i) {
    const Vector3d centre((i + 0.5) * kSegment, 0, 0);
    piece.push_back(duct ? Cylinder(centre, 0.5 * width, kSegment, 0)
                         : Box(centre, {kSegment, 0.5 * width, width}));
  }
  return piece;
}

std::vector<Part> Placed(const Piece& piece, const Eigen::Vector3d& at, double yaw) {
  const Eigen::Matrix3f R =
      Eigen::AngleAxisd(yaw, Vector3d::UnitZ()).toRotationMatrix().cast<float>();
  std::vector<Part> placed = piece;
  for (Part& part : placed) {
    part.primitive.p_ref = R * part.primitive.p_ref + at.cast<float>();
    part.primitive.R_local_ref = part.primitive.R_local_ref * R.transpose();
  }
  return placed;
}

int SceneClad::AddSheet(const std::string& paint, const Eigen::Vector2d& size_m, double texel_m,
                        Marks marks) {
  Rng rng(seed_, paint + " style");
  SheetStyle style;
  // Sheets differ in how many marks they have.
  const double crowd = rng.Uniform();
  style.tone = rng.Uniform(40, 180);
  style.panel_m = rng.Uniform(0.6, 2.5);
  style.shapes_per_m2 = 0.5 + 6 * crowd * crowd;
  if (marks == Marks::kFew) {
    constexpr double kShareLeft = 0.08;
    style.shapes_per_m2 *= kShareLeft;
    style.panel_m *= 3;
    style.noise = 3;
    style.stain = 10;
  }
  orders_.push_back({paint, size_m.x(), size_m.y(), coarseness_ * texel_m, style, marks});
  return static_cast<int>(orders_.size()) - 1;
}

void SceneClad::AddRoom(Marks marks, Scene* scene) {
  const Vector3d size = (scene->room_max - scene->room_min).cast<double>();
  constexpr int kAxes[3][2] = {{1, 2}, {0, 2}, {0, 1}};
  for (int face = 0; face < 6; ++face) {
    scene->room_surfaces[static_cast<size_t>(face)] =
        AddSheet(fmt::format("{} wall {}", stream_, face),
                 {size[kAxes[face / 2][0]], size[kAxes[face / 2][1]]}, 0.01, marks);
  }
}

void SceneClad::AddPart(const Part& part, Marks marks, Scene* scene) {
  const std::string paint = part.paint.empty()
                                ? fmt::format("{} part {}", stream_, scene->primitives.size())
                                : part.paint;
  Primitive primitive = part.primitive;
  for (int face = 0; face < 6; ++face) {
    if (primitive.kind == Primitive::Kind::kCylinder && face > 0 && face < 4) {
      continue;
    }
    const Eigen::Vector2d size = SheetSize(primitive, face);
    primitive.surfaces[static_cast<size_t>(face)] =
        AddSheet(fmt::format("{} face {}", paint, face), size, 0.006, marks);
  }
  scene->primitives.push_back(primitive);
}

void SceneClad::Paint(int detail_size, Scene* scene) {
  constexpr float kDetailTexel = 0.002f;
  const auto detail_m = static_cast<double>(kDetailTexel) * detail_size;
  Rng detail_rng(seed_, stream_ + " detail");
  scene->detail = Texture(PaintDetail(detail_size, &detail_rng), kDetailTexel, true);
  scene->surfaces.resize(orders_.size());
  std::atomic<size_t> next = 0;
  const auto work = [&] {
    for (size_t i = next++; i < orders_.size(); i = next++) {
      const Order& order = orders_[i];
      Rng rng(seed_, order.paint);
      Surface& surface = scene->surfaces[i];
      surface.texture =
          Texture(PaintSheet(order.width_m, order.height_m, order.texel_m, order.style, &rng),
                  static_cast<float>(order.texel_m), false);
      surface.detail_u = static_cast<float>(rng.Uniform(0, detail_m));
      surface.detail_v = static_cast<float>(rng.Uniform(0, detail_m));
      surface.detail_gain = static_cast<float>(rng.Uniform(0.15, 0.6));
      if (order.marks == Marks::kFew) {
        surface.detail_gain *= 0.1f;
      }
    }
  };
  std::thread helper(work);
  work();
  helper.join();
}

}  // namespace pangea::sim
