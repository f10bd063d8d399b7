#include "loop_verification/loop_verification_test_world.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <random>
#include <set>
#include <tuple>

#include "core/matching.h"
#include "core/testing/test_cameras.h"
#include "core/testing/test_descriptors.h"
#include "core/testing/test_random.h"

namespace pangea {
namespace {

using Random = std::mt19937_64;

double Normal(Random& random, double sigma) {
  return std::normal_distribution<double>(0, sigma)(random);
}

// Each bit flips with probability 1/16.
Descriptor WithFlips(const Descriptor& descriptor, Random& random) {
  Descriptor flipped = descriptor;
  for (uint64_t& word : flipped) {
    word ^= random() & random() & random() & random();
  }
  return flipped;
}

constexpr double kHalfX = 7, kHalfY = 5.5, kHeight = 4.5;

Eigen::Vector3d RandomSurfacePoint(Random& random) {
  const double x = Uniform(random, -kHalfX, kHalfX), y = Uniform(random, -kHalfY, kHalfY);
  const double z = Uniform(random, 0, kHeight);
  switch (random() % 6) {
    case 0:
      return {-kHalfX, y, z};
    case 1:
      return {kHalfX, y, z};
    case 2:
      return {x, -kHalfY, z};
    case 3:
      return {x, kHalfY, z};
    case 4:
      return {x, y, 0};
    default:  // furniture near the walls
      return {x > 0 ? kHalfX - 0.25 * x : -kHalfX - 0.25 * x, y, 0.6 * z};
  }
}

Rigid3 PoseAt(const TestAgentOptions& options, int k, Random& random) {
  const double angle = options.start_angle + k * options.step_angle;
  const double sign = options.step_angle < 0 ? -1 : 1;
  const double heading = angle + sign * (std::numbers::pi / 2 - options.look_outward);
  const Eigen::Quaterniond wobble =
      ExpSo3({Normal(random, 0.03), Normal(random, 0.03), Normal(random, 0.03)});
  return {YawRotation(heading) * wobble,
          {options.radius * std::cos(angle), options.radius * std::sin(angle),
           options.height + Normal(random, 0.05)}};
}

class AgentWalk {
 public:
  AgentWalk(const std::vector<TestPoint>& room, const TestAgentOptions& options)
      : room_(room), options_(options), random_(StableHash({options.map, 0}, {}, 99)) {
    for (size_t i = 0; i < room.size(); ++i) {
      tracked_.push_back(random_() % 100 < 35);
    }
  }

  TestAgent Run() {
    TestAgent agent;
    agent.room = room_;
    Rigid3 T_odom_body;
    for (int k = 0; k < options_.num_keyframes; ++k) {
      agent.T_room_body.push_back(PoseAt(options_, k, random_));
      Keyframe keyframe;
      keyframe.id = {options_.map, k};
      keyframe.utime = 1'000'000 + 250'000ll * k;
      keyframe.camera = EurocTestCamera();
      keyframe.roll_pitch_covariance = Eigen::Matrix2d::Identity() * 1e-5;
      if (k == 0) {
        const Rigid3 T_odom_room(
            ExpSo3({options_.odom_tilt, 0, 0}) * YawRotation(Uniform(random_, -3, 3)),
            {Uniform(random_, -9, 9), Uniform(random_, -9, 9), 0.4});
        T_odom_body = T_odom_room * agent.T_room_body[0];
      } else {
        keyframe.edge =
            Edge(agent.T_room_body[k - 1].Inverse() * agent.T_room_body[k], k - 1, T_odom_body.q);
        T_odom_body = T_odom_body * keyframe.edge->T_from_this;
      }
      keyframe.T_odom_body = T_odom_body;
      agent.point_of_corner.push_back(See(agent.T_room_body[k], &keyframe));
      agent.keyframes.push_back(std::move(keyframe));
    }
    return agent;
  }

 private:
  OdometryEdge Edge(const Rigid3& T_from_this, int from_seq,
                    const Eigen::Quaterniond& q_odom_from) {
    // Yaw drifts about the odom frame's z; roll and pitch much less: gravity holds them.
    const double s = options_.edge_sigma_rad;
    const Eigen::Vector3d sigmas_odom(s / 4, s / 4, s);
    const Eigen::Matrix3d R_from_odom = q_odom_from.conjugate().toRotationMatrix();
    OdometryEdge edge;
    edge.from_seq = from_seq;
    edge.covariance.setZero();
    edge.covariance.topLeftCorner<3, 3>().diagonal().setConstant(options_.edge_sigma_m *
                                                                 options_.edge_sigma_m);
    edge.covariance.bottomRightCorner<3, 3>() =
        R_from_odom * sigmas_odom.cwiseAbs2().asDiagonal() * R_from_odom.transpose();
    Vector6d noise;
    for (int i = 0; i < 3; ++i) {
      noise[i] = Normal(random_, options_.edge_sigma_m);
      noise[3 + i] = Normal(random_, sigmas_odom[i]);
    }
    noise.tail<3>() = (R_from_odom * noise.tail<3>()).eval();
    edge.T_from_this =
        Rigid3(T_from_this.q, std::exp(-options_.log_scale) * T_from_this.t).Plus(noise);
    return edge;
  }

  std::vector<int> See(const Rigid3& T_room_body, Keyframe* keyframe) {
    constexpr double kMinDepth = 0.5, kMaxDepth = 14;
    constexpr size_t kMaxPoints = 70, kClutter = 60;
    std::vector<int> point_of_corner;
    const Rigid3 T_cam_room = (T_room_body * keyframe->camera.T_body_cam).Inverse();
    for (size_t i = 0; i < room_.size() && keyframe->corners.size() + kClutter < kMaxCorners; ++i) {
      const Eigen::Vector3d p_cam = T_cam_room * room_[i].p_room;
      const auto pixel = keyframe->camera.Project(p_cam);
      if (!pixel || p_cam.z() < kMinDepth || p_cam.z() > kMaxDepth ||
          !keyframe->camera.Contains(*pixel, 4) ||
          Uniform(random_, 0, 1) > options_.detect_probability) {
        continue;
      }
      Corner corner;
      corner.pixel = (*pixel + Eigen::Vector2d(Normal(random_, options_.pixel_sigma),
                                               Normal(random_, options_.pixel_sigma)))
                         .cast<float>();
      corner.descriptor = WithFlips(room_[i].descriptor, random_);
      if (tracked_[i]) {
        corner.landmark_id = static_cast<int32_t>(i);
        if (keyframe->points.size() < kMaxPoints) {
          const double rho = std::exp(options_.log_scale) / p_cam.z();
          const double sigma = options_.relative_depth_sigma * rho;
          const double measured = std::max(0.2 * rho, rho + Normal(random_, sigma));
          keyframe->points.push_back({static_cast<int>(keyframe->corners.size()),
                                      static_cast<float>(measured),
                                      static_cast<float>(sigma * sigma)});
        }
      }
      keyframe->corners.push_back(corner);
      point_of_corner.push_back(static_cast<int>(i));
    }
    for (size_t i = 0; i < kClutter; ++i) {
      Corner corner;
      corner.pixel = {static_cast<float>(Uniform(random_, 4, 747)),
                      static_cast<float>(Uniform(random_, 4, 475))};
      corner.descriptor = RandomDescriptor(random_);
      keyframe->corners.push_back(corner);
      point_of_corner.push_back(-1);
    }
    return point_of_corner;
  }

  const std::vector<TestPoint>& room_;
  TestAgentOptions options_;
  Random random_;
  std::vector<bool> tracked_;
};

}  // namespace

std::vector<TestPoint> MakeTestRoom(const TestRoomOptions& options) {
  Random random(options.seed);
  std::vector<TestPoint> room;
  for (int i = 0; i < options.num_points; ++i) {
    const Eigen::Vector3d p = RandomSurfacePoint(random);
    room.push_back({p, RandomDescriptor(random)});
  }
  for (int object = 0; object < options.num_objects; ++object) {
    Random shape(options.object_seed + 1000 * static_cast<uint64_t>(object));
    const Rigid3 T_room_object(
        YawRotation(Uniform(random, -3, 3)),
        {Uniform(random, -0.85, 0.85) * kHalfX, Uniform(random, -0.85, 0.85) * kHalfY, 0.8});
    for (int i = 0; i < options.points_per_object; ++i) {
      const Eigen::Vector3d p(Uniform(shape, -0.4, 0.4), Uniform(shape, -0.4, 0.4),
                              Uniform(shape, -0.7, 0.7));
      room.push_back({T_room_object * p, RandomDescriptor(shape)});
    }
  }
  std::shuffle(room.begin(), room.end(), random);
  return room;
}

TestAgent RunTestAgent(const std::vector<TestPoint>& room, const TestAgentOptions& options) {
  return AgentWalk(room, options).Run();
}

PlaceCandidate MakeTestCandidate(const TestAgent& query_agent, int query,
                                 const TestAgent& match_agent, int match, int count, int wrong) {
  PlaceCandidate candidate;
  candidate.match = match_agent.keyframes[match].id;
  candidate.kind = candidate.match.map == query_agent.keyframes[query].id.map ? PlaceKind::kIntra
                                                                              : PlaceKind::kInter;
  candidate.score = 0.5;
  std::map<int, int> corner_of_point;
  const std::vector<int>& points_m = match_agent.point_of_corner[match];
  for (size_t i = 0; i < points_m.size(); ++i) {
    if (points_m[i] >= 0) {
      corner_of_point[points_m[i]] = static_cast<int>(i);
    }
  }
  const std::vector<int>& points_c = query_agent.point_of_corner[query];
  Random random(StableHash(query_agent.keyframes[query].id, candidate.match, 5));
  for (size_t i = 0; i < points_c.size(); ++i) {
    const auto it = corner_of_point.find(points_c[i]);
    if (it != corner_of_point.end() && static_cast<int>(candidate.corner_matches.size()) < count) {
      candidate.corner_matches.emplace_back(static_cast<int>(i), it->second);
    }
  }
  for (int i = 0; i < wrong; ++i) {
    candidate.corner_matches.emplace_back(static_cast<int>(random() % points_c.size()),
                                          static_cast<int>(random() % points_m.size()));
  }
  return candidate;
}

PlaceCandidate MakeTestCandidateByDescriptor(const TestAgent& query_agent, int query,
                                             const TestAgent& match_agent, int match) {
  const Keyframe& keyframe_c = query_agent.keyframes[query];
  const Keyframe& keyframe_m = match_agent.keyframes[match];
  PlaceCandidate candidate;
  candidate.match = keyframe_m.id;
  candidate.kind = candidate.match.map == keyframe_c.id.map ? PlaceKind::kIntra : PlaceKind::kInter;
  for (const CornerMatch& corners : MatchCorners(keyframe_c.corners, keyframe_m.corners, {})) {
    candidate.corner_matches.emplace_back(corners.a, corners.b);
  }
  return candidate;
}

std::vector<std::pair<int, int>> PairsThatShareMost(const TestAgent& query_agent,
                                                    const TestAgent& match_agent, int count) {
  // Counts common room points of equal descriptor: much faster than matching every pair of images.
  std::vector<std::tuple<int, int, int>> pairs;
  const auto seen = [](const TestAgent& agent, int k) {
    std::set<Descriptor> descriptors;
    for (const int point : agent.point_of_corner[k]) {
      if (point >= 0) {
        descriptors.insert(agent.room[point].descriptor);
      }
    }
    return descriptors;
  };
  std::vector<std::set<Descriptor>> seen_m;
  for (size_t m = 0; m < match_agent.keyframes.size(); ++m) {
    seen_m.push_back(seen(match_agent, static_cast<int>(m)));
  }
  for (size_t c = 0; c < query_agent.keyframes.size(); ++c) {
    const std::set<Descriptor> seen_c = seen(query_agent, static_cast<int>(c));
    for (size_t m = 0; m < seen_m.size(); ++m) {
      const auto shared = std::count_if(seen_c.begin(), seen_c.end(),
                                        [&](const Descriptor& d) { return seen_m[m].contains(d); });
      pairs.emplace_back(-static_cast<int>(shared), static_cast<int>(c), static_cast<int>(m));
    }
  }
  std::sort(pairs.begin(), pairs.end());
  std::vector<std::pair<int, int>> most;
  for (size_t i = 0; i < pairs.size() && static_cast<int>(i) < count; ++i) {
    most.emplace_back(std::get<1>(pairs[i]), std::get<2>(pairs[i]));
  }
  return most;
}

}  // namespace pangea
