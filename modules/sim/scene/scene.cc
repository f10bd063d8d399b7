#include "sim/scene/scene.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace pangea::sim {
namespace {

using Eigen::Vector3f;

// The two other axes of a box's face, in the order u, v.
constexpr int kAxisU[3] = {1, 0, 0};
constexpr int kAxisV[3] = {2, 2, 1};

// Fills in a hit on the face normal to `axis` of a box with corner `low`, in the box's own frame.
void SetBoxFace(const Vector3f& p, const Vector3f& d, const Vector3f& low, int axis, bool high,
                Hit* hit) {
  hit->face = 2 * axis + (high ? 1 : 0);
  hit->u = p[kAxisU[axis]] - low[kAxisU[axis]];
  hit->v = p[kAxisV[axis]] - low[kAxisV[axis]];
  hit->du = d[kAxisU[axis]];
  hit->dv = d[kAxisV[axis]];
  hit->cosine = std::abs(d[axis]);
}

bool IntersectBox(const Primitive& box, int index, const Vector3f& o, const Vector3f& d, Hit* hit) {
  float enter = 0;
  float exit = hit->range;
  int axis = -1;
  for (int i = 0; i < 3; ++i) {
    const float inverse = 1.0f / d[i];
    const float middle = -o[i] * inverse;
    const float reach = std::abs(inverse) * box.half[i];
    if (middle - reach > enter) {
      enter = middle - reach;
      axis = i;
    }
    exit = std::min(exit, middle + reach);
  }
  if (axis < 0 || !(enter < exit)) {
    return false;
  }
  hit->range = enter;
  hit->primitive = index;
  const bool high = d[axis] < 0;
  SetBoxFace(o + enter * d, d, -box.half, axis, high, hit);
  hit->normal = box.R_local_ref.row(axis).transpose() * (high ? 1.0f : -1.0f);
  return true;
}

void SetMantle(const Primitive& cylinder, const Vector3f& p, const Vector3f& d, Hit* hit) {
  const float radius = cylinder.half.x();
  const Vector3f normal(p.x() / radius, p.y() / radius, 0);
  const float angle = std::atan2(p.y(), p.x()) + static_cast<float>(M_PI);
  hit->face = 0;
  hit->u = angle * radius;
  hit->v = p.z() + cylinder.half.z();
  hit->du = d.y() * normal.x() - d.x() * normal.y();
  hit->dv = d.z();
  hit->cosine = std::abs(d.dot(normal));
  hit->normal = cylinder.R_local_ref.transpose() * normal;
}

bool IntersectCylinder(const Primitive& cylinder, int index, const Vector3f& o, const Vector3f& d,
                       Hit* hit) {
  const float radius = cylinder.half.x();
  const float length = cylinder.half.z();
  const float a = d.x() * d.x() + d.y() * d.y();
  const float b = o.x() * d.x() + o.y() * d.y();
  const float c = o.x() * o.x() + o.y() * o.y() - radius * radius;
  const float discriminant = b * b - a * c;
  if (discriminant <= 0) {
    return false;  // also rays along the axis, which could only meet a cap
  }
  const float root = std::sqrt(discriminant);
  const float mantle = (-b - root) / a;
  const float z = o.z() + mantle * d.z();
  if (mantle > 0 && mantle < hit->range && std::abs(z) <= length) {
    hit->range = mantle;
    hit->primitive = index;
    SetMantle(cylinder, o + mantle * d, d, hit);
    return true;
  }
  const float cap = (d.z() < 0 ? length - o.z() : -length - o.z()) / d.z();
  if (!(cap > 0 && cap < hit->range)) {
    return false;
  }
  const Vector3f p = o + cap * d;
  if (p.x() * p.x() + p.y() * p.y() > radius * radius) {
    return false;
  }
  hit->range = cap;
  hit->primitive = index;
  const bool top = d.z() < 0;
  SetBoxFace(p, d, Vector3f(-radius, -radius, -length), 2, top, hit);
  hit->normal = cylinder.R_local_ref.row(2).transpose() * (top ? 1.0f : -1.0f);
  return true;
}

}  // namespace

float Primitive::BoundingRadius() const {
  return kind == Kind::kBox ? half.norm() : std::hypot(half.x(), half.z());
}

float Primitive::Distance(const Vector3f& p) const {
  const Vector3f local = R_local_ref * (p - p_ref);
  if (kind == Kind::kBox) {
    return (local.cwiseAbs() - half).cwiseMax(0.0f).norm();
  }
  const float radial = std::max(local.head<2>().norm() - half.x(), 0.0f);
  return std::hypot(radial, std::max(std::abs(local.z()) - half.z(), 0.0f));
}

bool IntersectRoom(const Scene& scene, const Vector3f& origin, const Vector3f& direction,
                   Hit* hit) {
  float exit = hit->range;
  int axis = -1;
  for (int i = 0; i < 3; ++i) {
    const float wall = direction[i] > 0 ? scene.room_max[i] : scene.room_min[i];
    const float range = (wall - origin[i]) / direction[i];
    if (range < exit) {
      exit = range;
      axis = i;
    }
  }
  if (axis < 0 || exit < 0) {
    return false;
  }
  hit->range = exit;
  hit->primitive = -1;
  const bool high = direction[axis] > 0;
  SetBoxFace(origin + exit * direction, direction, scene.room_min, axis, high, hit);
  hit->normal = Vector3f::Unit(axis) * (high ? -1.0f : 1.0f);
  return true;
}

bool IntersectPrimitive(const Primitive& primitive, int index, const Vector3f& origin,
                        const Vector3f& direction, Hit* hit) {
  const Vector3f o = primitive.R_local_ref * (origin - primitive.p_ref);
  const Vector3f d = primitive.R_local_ref * direction;
  return primitive.kind == Primitive::Kind::kBox ? IntersectBox(primitive, index, o, d, hit)
                                                 : IntersectCylinder(primitive, index, o, d, hit);
}

const Surface& Scene::SurfaceOf(const Hit& hit) const {
  const auto face = static_cast<size_t>(hit.face);
  const int surface = hit.primitive < 0
                          ? room_surfaces[face]
                          : primitives[static_cast<size_t>(hit.primitive)].surfaces[face];
  return surfaces[static_cast<size_t>(surface)];
}

float Scene::Shade(const Hit& hit, float pixel_angle) const {
  const Surface& surface = SurfaceOf(hit);
  Footprint footprint{.u = hit.u, .v = hit.v, .minor = pixel_angle * hit.range};
  const float along = std::sqrt(hit.du * hit.du + hit.dv * hit.dv);
  if (along > 1e-4f) {
    footprint.major_u = hit.du / along;
    footprint.major_v = hit.dv / along;
  }
  constexpr float kGrazing = 0.02f;
  footprint.major = footprint.minor / std::max(hit.cosine, kGrazing);
  float grey = surface.texture.Sample(footprint);
  // No fine detail where a pixel is wider than its largest marks.
  constexpr float kDetailEndsAt = 0.12f;
  if (surface.detail_gain > 0 && footprint.minor < kDetailEndsAt) {
    footprint.u += surface.detail_u;
    footprint.v += surface.detail_v;
    const float mean = 128.0f;
    grey *= 1.0f + surface.detail_gain * (detail.Sample(footprint) - mean) / mean;
  }
  const float lambert = 0.92f + 0.18f * hit.normal.z() + 0.25f * hit.normal.dot(light);
  return grey * lambert;
}

std::optional<Hit> Scene::Cast(const Vector3f& origin, const Vector3f& direction) const {
  Hit hit;
  hit.range = std::numeric_limits<float>::max();
  bool any = IntersectRoom(*this, origin, direction, &hit);
  for (size_t i = 0; i < primitives.size(); ++i) {
    any |= IntersectPrimitive(primitives[i], static_cast<int>(i), origin, direction, &hit);
  }
  return any ? std::make_optional(hit) : std::nullopt;
}

}  // namespace pangea::sim
