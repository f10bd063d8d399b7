#pragma once

// Valid keyframes of realistic size for tests. The same id gives the same keyframe.

#include <random>

#include "core/testing/test_descriptors.h"
#include "link/wire.h"
#include "messages/encoding.h"

namespace pangea {

inline Keyframe TestKeyframe(const KeyframeId& id, int num_corners = 600) {
  std::mt19937_64 rng(StableHash(id, id, 1));
  std::uniform_real_distribution<float> unit(0, 1);
  Keyframe keyframe;
  keyframe.id = id;
  keyframe.utime = 1'000'000 + 250'000 * static_cast<int64_t>(id.seq);
  keyframe.camera.width = 752;
  keyframe.camera.height = 480;
  keyframe.camera.fx = keyframe.camera.fy = 458 + 0.001 * id.seq;  // a lens that focuses
  keyframe.camera.cx = 367;
  keyframe.camera.cy = 248;
  if (id.seq > 0) {
    keyframe.edge = OdometryEdge{id.seq - 1, {}, 1e-4 * Matrix6d::Identity()};
  }
  for (int i = 0; i < num_corners; ++i) {
    Corner corner;
    corner.pixel = {unit(rng) * 751, unit(rng) * 479};
    corner.descriptor = RandomDescriptor(rng);
    corner.landmark_id = i < 100 ? i : kNoLandmark;
    keyframe.corners.push_back(corner);
  }
  for (int i = 0; i < 70 && i < num_corners; ++i) {
    keyframe.points.push_back({i, 0.2f, 0.001f});
  }
  return keyframe;
}

inline std::vector<uint8_t> EncodeTestKeyframe(const KeyframeId& id) {
  return EncodeMessage(ToMessage(TestKeyframe(id)));
}

}  // namespace pangea
