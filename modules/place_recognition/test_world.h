#pragma once

// A small world for this module's tests: points on the walls of a room, each with a descriptor,
// which keyframes anywhere in the room see with bit and pixel noise.

#include <algorithm>
#include <random>
#include <vector>

#include "core/keyframe.h"
#include "core/testing/test_cameras.h"
#include "core/testing/test_descriptors.h"

namespace pangea::test {

inline const MapId kMapA{1, 1000};
inline const MapId kMapB{2, 2000};

struct TestWorldOptions {
  int num_points = 6000;
  double room_m = 12;     // a box, room_m x room_m x 4
  int flipped_bits = 25;  // per observation
  double pixel_sigma = 0.7;
  int max_corners = 500;
  int clutter = 150;  // corners that no other keyframe has
};

class TestWorld {
 public:
  explicit TestWorld(uint64_t seed, TestWorldOptions options = {}) : options_(options), rng_(seed) {
    std::uniform_real_distribution<double> along(-options_.room_m / 2, options_.room_m / 2);
    std::uniform_real_distribution<double> height(0, 4);
    for (int i = 0; i < options_.num_points; ++i) {
      const double side = i % 2 == 0 ? -options_.room_m / 2 : options_.room_m / 2;
      const double a = along(rng_);
      const double z = height(rng_);
      const Eigen::Vector3d p =
          i % 4 < 2 ? Eigen::Vector3d(side, a, z) : Eigen::Vector3d(a, side, z);
      points_.push_back(p);
      descriptors_.push_back(RandomDescriptor(rng_));
    }
  }

  // The keyframe of a body (x forward, z up) at this position and yaw. `T_odom_world` defines the
  // map's odom frame. If `tracked`, landmark ids are the indices of the points.
  Keyframe See(const KeyframeId& id, const Eigen::Vector3d& p_world, double yaw,
               const Rigid3& T_odom_world = {}, bool tracked = false, double pitch = 0) {
    Keyframe keyframe;
    keyframe.id = id;
    keyframe.utime = int64_t{id.seq} * 250'000;
    keyframe.camera = EurocTestCamera();
    const Rigid3 T_world_body(YawRotation(yaw) * ExpSo3(Eigen::Vector3d(0, pitch, 0)), p_world);
    keyframe.T_odom_body = T_odom_world * T_world_body;
    const Rigid3 T_cam_world = (T_world_body * keyframe.camera.T_body_cam).Inverse();
    std::normal_distribution<double> noise(0, options_.pixel_sigma);
    std::vector<int> order(points_.size());
    for (int i = 0; i < static_cast<int>(order.size()); ++i) {
      order[i] = i;
    }
    std::shuffle(order.begin(), order.end(), rng_);
    for (const int i : order) {
      const auto pixel = keyframe.camera.Project(T_cam_world * points_[i]);
      if (!pixel || !keyframe.camera.Contains(*pixel, 5) ||
          static_cast<int>(keyframe.corners.size()) >= options_.max_corners) {
        continue;
      }
      Corner corner;
      corner.pixel = (*pixel + Eigen::Vector2d(noise(rng_), noise(rng_))).cast<float>();
      corner.descriptor = Noisy(descriptors_[i]);
      corner.landmark_id = tracked ? i : kNoLandmark;
      keyframe.corners.push_back(corner);
    }
    AddClutter(&keyframe);
    return keyframe;
  }

 private:
  Descriptor Noisy(Descriptor descriptor) {
    for (int i = 0; i < options_.flipped_bits; ++i) {
      FlipBit(&descriptor, rng_() % kDescriptorBits);
    }
    return descriptor;
  }
  void AddClutter(Keyframe* keyframe) {
    std::uniform_real_distribution<float> u(10, 740);
    std::uniform_real_distribution<float> v(10, 470);
    for (int i = 0; i < options_.clutter; ++i) {
      Corner corner;
      corner.pixel.x() = u(rng_);
      corner.pixel.y() = v(rng_);
      corner.descriptor = RandomDescriptor(rng_);
      keyframe->corners.push_back(corner);
    }
  }

  TestWorldOptions options_;
  std::mt19937_64 rng_;
  std::vector<Eigen::Vector3d> points_;
  std::vector<Descriptor> descriptors_;
};

}  // namespace pangea::test
