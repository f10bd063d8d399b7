#pragma once

// A textured room with boxes and cylinders in it. Frame `ref`: metres, z up.

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <optional>
#include <vector>

#include "sim/scene/texture.h"

namespace pangea::sim {

// A painted sheet: its own texture, multiplied by a window of the scene's fine detail.
struct Surface {
  Texture texture;
  float detail_u = 0, detail_v = 0;  // origin of the window, metres
  float detail_gain = 0.5f;          // 0: none
};

struct Primitive {
  enum class Kind { kBox, kCylinder };
  Kind kind = Kind::kBox;
  Eigen::Matrix3f R_local_ref = Eigen::Matrix3f::Identity();
  Eigen::Vector3f p_ref = Eigen::Vector3f::Zero();  // centre
  // Box: half sizes. Cylinder: radius, radius, half length; its axis is the local z.
  Eigen::Vector3f half = Eigen::Vector3f::Ones();
  // Box: -x +x -y +y -z +z. Cylinder: 0 mantle, 4 bottom, 5 top.
  std::array<int, 6> surfaces{};

  float BoundingRadius() const;
  // Distance of a point from the primitive, 0 inside.
  float Distance(const Eigen::Vector3f& p) const;
};

// The point where a ray meets the scene.
struct Hit {
  float range = 0;     // along the unit ray
  int primitive = -1;  // -1: the room itself
  int face = 0;
  float u = 0, v = 0;                                 // on the surface, metres
  float du = 0, dv = 0;                               // the ray's direction along u and v
  float cosine = 1;                                   // of the angle between ray and normal
  Eigen::Vector3f normal = Eigen::Vector3f::UnitZ();  // towards the viewer
};

struct Scene {
  Eigen::Vector3f room_min = Eigen::Vector3f::Zero();
  Eigen::Vector3f room_max = Eigen::Vector3f::Ones();
  std::array<int, 6> room_surfaces{};                // -x +x -y +y -z +z
  Eigen::Vector3f light = Eigen::Vector3f::UnitZ();  // unit, towards the lamp
  std::vector<Primitive> primitives;
  std::vector<Surface> surfaces;
  Texture detail;

  const Surface& SurfaceOf(const Hit& hit) const;
  // Grey value, 0 .. 255, of a pixel with the given angular width (radians).
  float Shade(const Hit& hit, float pixel_angle) const;
  // The nearest hit; empty if `origin` is outside the room.
  std::optional<Hit> Cast(const Eigen::Vector3f& origin, const Eigen::Vector3f& direction) const;
};

// Improve `hit` (its range is the limit) if the ray meets the room's inside or the primitive.
bool IntersectRoom(const Scene& scene, const Eigen::Vector3f& origin,
                   const Eigen::Vector3f& direction, Hit* hit);
bool IntersectPrimitive(const Primitive& primitive, int index, const Eigen::Vector3f& origin,
                        const Eigen::Vector3f& direction, Hit* hit);

}  // namespace pangea::sim
