#include "sim/render/renderer.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace pangea::sim {
namespace {

using Eigen::Vector3f;

float Angle(const Vector3f& a, const Vector3f& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

}  // namespace

// State of one frame's rendering, shared by its tiles.
struct Renderer::FrameState {
  std::vector<RowPose> rows;
  std::vector<Vector3f> centres;  // of the primitives, in the frame of the middle row's camera
  std::vector<float> slack;       // how far a rolling shutter moves the camera, as a radius
  std::vector<std::vector<Candidate>> candidates;  // by tile
  std::vector<int32_t> keys;                       // what each pixel sees: primitive and face
  RenderedView view;

  const RowPose& Row(int y) const {
    return rows.size() == 1 ? rows[0] : rows[static_cast<size_t>(y)];
  }
};

Renderer::Renderer(const Scene& scene, const CameraModel& camera) : scene_(scene), camera_(camera) {
  MakeRays();
  MakeTiles();
}

void Renderer::MakeRays() {
  rays_.resize(static_cast<size_t>(camera_.width) * static_cast<size_t>(camera_.height));
  for (int y = 0; y < camera_.height; ++y) {
    for (int x = 0; x < camera_.width; ++x) {
      PixelRay& ray = rays_[static_cast<size_t>(y) * static_cast<size_t>(camera_.width) +
                            static_cast<size_t>(x)];
      const auto xy = camera_.Unproject({x, y});
      const auto right = camera_.Unproject({x + 1, y});
      const auto below = camera_.Unproject({x, y + 1});
      if (!xy || !right || !below) {
        ray.direction = Vector3f::UnitZ();
        continue;
      }
      const Eigen::Vector3d d = xy->homogeneous().normalized();
      ray.direction = d.cast<float>();
      ray.angle = static_cast<float>(std::sqrt((right->homogeneous().normalized() - d).norm() *
                                               (below->homogeneous().normalized() - d).norm()));
      ray.valid = true;
    }
  }
}

void Renderer::MakeTiles() {
  tiles_across_ = (camera_.width + kTile - 1) / kTile;
  const int tiles_down = (camera_.height + kTile - 1) / kTile;
  for (int i = 0; i < tiles_across_ * tiles_down; ++i) {
    const int x0 = i % tiles_across_ * kTile;
    const int y0 = i / tiles_across_ * kTile;
    const int x1 = std::min(x0 + kTile, camera_.width) - 1;
    const int y1 = std::min(y0 + kTile, camera_.height) - 1;
    TileCone cone{RayAt((x0 + x1) / 2, (y0 + y1) / 2).direction, 0};
    for (const int x : {x0, (x0 + x1) / 2, x1}) {
      for (const int y : {y0, (y0 + y1) / 2, y1}) {
        cone.half_angle = std::max(cone.half_angle, Angle(cone.axis, RayAt(x, y).direction));
      }
    }
    cone.half_angle *= 1.1f;  // for the width of a pixel, and for edges that bend outwards
    tiles_.push_back(cone);
  }
}

void Renderer::FindCandidates(int tile, FrameState* state) const {
  const TileCone& cone = tiles_[static_cast<size_t>(tile)];
  const float cos_half = std::cos(cone.half_angle);
  const float sin_half = std::sin(cone.half_angle);
  std::vector<Candidate>& candidates = state->candidates[static_cast<size_t>(tile)];
  for (size_t i = 0; i < scene_.primitives.size(); ++i) {
    const Vector3f& c = state->centres[i];
    const float radius = state->slack[i];
    const float along = c.dot(cone.axis);
    const float distance2 = c.squaredNorm();
    const float across = std::sqrt(std::max(distance2 - along * along, 0.0f));
    // Compare the distance of the centre from the cone's surface with the radius.
    if (across * cos_half - along * sin_half > radius || along + radius < 0) {
      continue;
    }
    candidates.push_back({std::sqrt(distance2) - radius, static_cast<int>(i)});
  }
  std::ranges::sort(candidates, [](const Candidate& a, const Candidate& b) {
    return a.nearest != b.nearest ? a.nearest < b.nearest : a.primitive < b.primitive;
  });
}

Hit Renderer::CastPixel(const RowPose& pose, const Vector3f& direction_cam,
                        const std::vector<Candidate>& candidates) const {
  const Vector3f d = pose.R_ref_cam * direction_cam;
  Hit hit;
  hit.range = std::numeric_limits<float>::max();
  for (const Candidate& candidate : candidates) {
    if (candidate.nearest > hit.range) {
      break;
    }
    IntersectPrimitive(scene_.primitives[static_cast<size_t>(candidate.primitive)],
                       candidate.primitive, pose.p_ref_cam, d, &hit);
  }
  IntersectRoom(scene_, pose.p_ref_cam, d, &hit);
  return hit;
}

void Renderer::RenderTile(int tile, FrameState* state) const {
  const auto& candidates = state->candidates[static_cast<size_t>(tile)];
  const int x0 = tile % tiles_across_ * kTile;
  const int y0 = tile / tiles_across_ * kTile;
  for (int y = y0; y < std::min(y0 + kTile, camera_.height); ++y) {
    for (int x = x0; x < std::min(x0 + kTile, camera_.width); ++x) {
      const PixelRay& ray = RayAt(x, y);
      const Hit hit = CastPixel(state->Row(y), ray.direction, candidates);
      state->keys[static_cast<size_t>(y) * static_cast<size_t>(camera_.width) +
                  static_cast<size_t>(x)] = 8 * hit.primitive + hit.face;
      state->view.range.at<float>(y, x) = hit.range;
      state->view.grey.at<float>(y, x) = ray.valid ? scene_.Shade(hit, ray.angle) : 0.0f;
    }
  }
}

// Mean of a pixel crossed by an edge, from five rays, spread so that an edge of any direction
// crosses them one after another.
float Renderer::ShadeAcross(int x, int y, const FrameState& state) const {
  constexpr float kOffsets[5][2] = {
      {0, 0}, {-0.4f, -0.2f}, {0.2f, -0.4f}, {0.4f, 0.2f}, {-0.2f, 0.4f}};
  const int right = x + 1 < camera_.width ? x + 1 : x - 1;
  const int below = y + 1 < camera_.height ? y + 1 : y - 1;
  const PixelRay& ray = RayAt(x, y);
  const Vector3f dx = (RayAt(right, y).direction - ray.direction) * static_cast<float>(right - x);
  const Vector3f dy = (RayAt(x, below).direction - ray.direction) * static_cast<float>(below - y);
  const int tile = y / kTile * tiles_across_ + x / kTile;
  float sum = 0;
  for (const auto& offset : kOffsets) {
    const Vector3f d = (ray.direction + offset[0] * dx + offset[1] * dy).normalized();
    const Hit hit = CastPixel(state.Row(y), d, state.candidates[static_cast<size_t>(tile)]);
    sum += scene_.Shade(hit, ray.angle);
  }
  return sum / 5;
}

void Renderer::SmoothEdges(int tile, FrameState* state) const {
  const int width = camera_.width;
  const auto key = [&](int x, int y) {
    return state
        ->keys[static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x)];
  };
  const int x0 = std::max(tile % tiles_across_ * kTile, 1);
  const int y0 = std::max(tile / tiles_across_ * kTile, 1);
  const int x1 = std::min(tile % tiles_across_ * kTile + kTile, width - 1);
  const int y1 = std::min(tile / tiles_across_ * kTile + kTile, camera_.height - 1);
  for (int y = y0; y < y1; ++y) {
    for (int x = x0; x < x1; ++x) {
      const int32_t own = key(x, y);
      const bool edge = key(x - 1, y) != own || key(x + 1, y) != own || key(x, y - 1) != own ||
                        key(x, y + 1) != own;
      if (edge && RayAt(x, y).valid) {
        state->view.grey.at<float>(y, x) = ShadeAcross(x, y, *state);
      }
    }
  }
}

RenderedView Renderer::Render(const std::vector<Rigid3>& T_ref_cam) const {
  FrameState state;
  for (const Rigid3& T : T_ref_cam) {
    state.rows.push_back({T.R().cast<float>(), T.t.cast<float>()});
  }
  const RowPose& middle = state.Row(camera_.height / 2);
  float rotation = 0;
  float move = 0;
  for (const RowPose& row : state.rows) {
    move = std::max(move, (row.p_ref_cam - middle.p_ref_cam).norm());
    rotation = std::max(rotation, (row.R_ref_cam - middle.R_ref_cam).norm());
  }
  for (const Primitive& primitive : scene_.primitives) {
    state.centres.emplace_back(middle.R_ref_cam.transpose() * (primitive.p_ref - middle.p_ref_cam));
    state.slack.push_back(primitive.BoundingRadius() + move +
                          rotation * state.centres.back().norm());
  }
  state.keys.resize(rays_.size());
  state.candidates.resize(tiles_.size());
  state.view.grey.create(camera_.height, camera_.width, CV_32F);
  state.view.range.create(camera_.height, camera_.width, CV_32F);
  const int num_tiles = static_cast<int>(tiles_.size());
  for (int tile = 0; tile < num_tiles; ++tile) {
    FindCandidates(tile, &state);
    RenderTile(tile, &state);
  }
  for (int tile = 0; tile < num_tiles; ++tile) {
    SmoothEdges(tile, &state);
  }
  return state.view;
}

}  // namespace pangea::sim
