#include "core/testing/synthetic_world.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/testing/test_cameras.h"
#include "core/testing/test_descriptors.h"

namespace pangea {
namespace {

using Random = std::mt19937_64;
using std::numbers::pi;

double Uniform(Random& random, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(random);
}

double Normal(Random& random, double sigma) {
  return sigma * std::normal_distribution<double>(0, 1)(random);
}

Eigen::Vector3d NormalVector(Random& random, double sigma) {
  return {Normal(random, sigma), Normal(random, sigma), Normal(random, sigma)};
}

Descriptor WithFlips(Descriptor descriptor, double probability, Random& random) {
  std::bernoulli_distribution flip(probability);
  for (int bit = 0; bit < kDescriptorBits; ++bit) {
    descriptor[bit / 64] ^= static_cast<uint64_t>(flip(random)) << (bit % 64);
  }
  return descriptor;
}

Eigen::Vector3d RandomSurfacePoint(const SyntheticWorldOptions& options, Random& random) {
  const double x = Uniform(random, -0.5, 0.5) * options.length_m;
  const double y = Uniform(random, -0.5, 0.5) * options.width_m;
  const double z = Uniform(random, 0, options.height_m);
  constexpr double kInside = 0.85;  // boxes stand within this share of the way to the wall
  switch (random() % 6) {
    case 0:
      return {std::copysign(0.5 * options.length_m, x), y, z};
    case 1:
    case 2:
      return {x, std::copysign(0.5 * options.width_m, y), z};
    case 3:
      return {x, y, 0};
    case 4:
      return {x, kInside * std::copysign(0.5 * options.width_m, y), 0.4 * z};
    default:
      return {kInside * std::copysign(0.5 * options.length_m, x), y, 0.4 * z};
  }
}

std::vector<SyntheticPoint> MakePoints(const SyntheticWorldOptions& options, Random& random) {
  std::vector<SyntheticPoint> points;
  for (int i = 0; i < options.num_points; ++i) {
    const Eigen::Vector3d p = RandomSurfacePoint(options, random);
    points.push_back({p, RandomDescriptor(random)});
  }
  for (int object = 0; object < options.num_objects; ++object) {
    Random shape(options.object_seed + 1000 * static_cast<uint64_t>(object));
    const Rigid3 T_hall_object(YawRotation(Uniform(random, -pi, pi)),
                               {Uniform(random, -0.4, 0.4) * options.length_m,
                                Uniform(random, -0.4, 0.4) * options.width_m, 0.8});
    for (int i = 0; i < options.points_per_object; ++i) {
      const Eigen::Vector3d p(Uniform(shape, -0.4, 0.4), Uniform(shape, -0.4, 0.4),
                              Uniform(shape, -0.7, 0.7));
      points.push_back({T_hall_object * p, RandomDescriptor(shape)});
    }
  }
  std::shuffle(points.begin(), points.end(), random);
  return points;
}

class AgentWalk {
 public:
  AgentWalk(const SyntheticWorldOptions& options, const std::vector<SyntheticPoint>& points,
            int number, Random& random)
      : options_(options), points_(points), random_(random) {
    agent_.map = {number + 1, options.opened_utime + number};
    start_ = number * options.start_apart;
    for (double& phase : phases_) {
      phase = Uniform(random_, -pi, pi);
    }
    for (size_t i = 0; i < points.size(); ++i) {
      tracked_.push_back(Uniform(random_, 0, 1) < options.tracked_share);
    }
  }

  SyntheticAgent Run() {
    for (int k = 0; k < options_.num_keyframes; ++k) {
      agent_.T_hall_body.push_back(TruePose(k));
      Keyframe keyframe;
      keyframe.id = {agent_.map, k};
      keyframe.utime = 1'000'000 + 400'000ll * k;
      keyframe.camera = EurocTestCamera();
      keyframe.roll_pitch_covariance =
          Eigen::Matrix2d::Identity() * std::pow(options_.tilt_sigma, 2);
      Odometry(k, &keyframe);
      agent_.point_of_corner.push_back(options_.with_corners ? See(agent_.T_hall_body[k], &keyframe)
                                                             : std::vector<int>());
      agent_.keyframes.push_back(std::move(keyframe));
    }
    return std::move(agent_);
  }

 private:
  // An ellipse through the hall, swaying; the view swings about outward-ahead.
  Rigid3 TruePose(int k) const {
    const double rx = 0.3 * options_.length_m, ry = 0.28 * options_.width_m;
    const double walked = k * options_.step_m;
    const double angle = 2 * pi * start_ + walked / (0.5 * (rx + ry));
    const auto sway = [&](int i, double period_m, double size) {
      return size * std::sin(2 * pi * walked / period_m + phases_[i]);
    };
    const double heading = std::atan2(ry * std::cos(angle), -rx * std::sin(angle));
    const Eigen::Vector3d p(rx * std::cos(angle) + sway(0, 7.1, 0.4),
                            ry * std::sin(angle) + sway(1, 5.3, 0.4), 1.6 + sway(2, 3.7, 0.15));
    const Eigen::Quaterniond swing = ExpSo3({sway(3, 2.9, 0.05), sway(4, 3.3, 0.08), 0});
    return {(YawRotation(heading - 0.7 + sway(5, 9.7, 0.3)) * swing).normalized(), p};
  }

  // Position and yaw drift by a random walk; the tilt error wanders but stays bounded.
  void Odometry(int k, Keyframe* keyframe) {
    const Rigid3& T_hall_body = agent_.T_hall_body[k];
    constexpr double kKept = 0.95;  // share of the tilt error that the next keyframe keeps
    const Eigen::Vector3d fresh(Normal(random_, options_.tilt_sigma),
                                Normal(random_, options_.tilt_sigma), 0);
    Eigen::Vector3d p_odom(Uniform(random_, -9, 9), Uniform(random_, -9, 9), 0.4);
    Eigen::Vector3d tilt = fresh;
    if (k == 0) {
      yaw_odom_hall_ = Uniform(random_, -pi, pi);
    } else {
      const Keyframe& last = agent_.keyframes.back();
      const Eigen::Vector3d step_hall = T_hall_body.t - agent_.T_hall_body[k - 1].t;
      p_odom = last.T_odom_body.t + ExpSo3(tilt_) * (YawRotation(yaw_odom_hall_) * step_hall) +
               NormalVector(random_, options_.edge_sigma_m);
      yaw_odom_hall_ += Normal(random_, options_.edge_sigma_yaw);
      tilt = kKept * tilt_ + std::sqrt(1 - kKept * kKept) * fresh;
    }
    tilt_ = tilt;
    keyframe->T_odom_body = {
        (ExpSo3(tilt_) * YawRotation(yaw_odom_hall_) * T_hall_body.q).normalized(), p_odom};
    if (k > 0) {
      keyframe->edge = Edge(agent_.keyframes.back(), *keyframe);
    }
  }

  OdometryEdge Edge(const Keyframe& from, const Keyframe& to) const {
    OdometryEdge edge;
    edge.from_seq = from.id.seq;
    edge.T_from_this = from.T_odom_body.Inverse() * to.T_odom_body;
    const double scale = options_.claimed_sigma_scale * options_.claimed_sigma_scale;
    const double tilt_step = 0.3 * options_.tilt_sigma;
    const Eigen::Vector3d variances =
        Eigen::Vector3d(tilt_step, tilt_step, options_.edge_sigma_yaw).cwiseAbs2();
    const Eigen::Matrix3d R_body_odom = from.T_odom_body.R().transpose();
    edge.covariance.setZero();
    edge.covariance.topLeftCorner<3, 3>().diagonal().setConstant(
        scale * std::pow(options_.edge_sigma_m, 2));
    edge.covariance.bottomRightCorner<3, 3>() =
        scale * (R_body_odom * variances.asDiagonal() * R_body_odom.transpose());
    return edge;
  }

  std::vector<int> See(const Rigid3& T_hall_body, Keyframe* keyframe) {
    constexpr double kMinDepth = 0.5, kMaxDepth = 16;
    constexpr size_t kMaxPoints = 70;
    const size_t max_seen = kMaxCorners - static_cast<size_t>(options_.clutter);
    std::vector<int> point_of_corner;
    const Rigid3 T_cam_hall = (T_hall_body * keyframe->camera.T_body_cam).Inverse();
    for (size_t i = 0; i < points_.size() && keyframe->corners.size() < max_seen; ++i) {
      const Eigen::Vector3d p_cam = T_cam_hall * points_[i].p_hall;
      const auto pixel = keyframe->camera.Project(p_cam);
      if (!pixel || p_cam.z() < kMinDepth || p_cam.z() > kMaxDepth ||
          !keyframe->camera.Contains(*pixel, 8) ||
          Uniform(random_, 0, 1) > options_.detect_probability) {
        continue;
      }
      Corner corner = NoisyCorner(*pixel, p_cam.z());
      corner.descriptor = WithFlips(points_[i].descriptor, options_.flip_probability, random_);
      if (tracked_[i]) {
        corner.landmark_id = static_cast<int32_t>(i);
        if (keyframe->points.size() < kMaxPoints) {
          const double rho = 1 / p_cam.z(), sigma = options_.relative_depth_sigma * rho;
          keyframe->points.push_back(
              {static_cast<int>(keyframe->corners.size()),
               static_cast<float>(std::max(0.2 * rho, rho + Normal(random_, sigma))),
               static_cast<float>(sigma * sigma)});
        }
      }
      keyframe->corners.push_back(corner);
      point_of_corner.push_back(static_cast<int>(i));
    }
    for (int i = 0; i < options_.clutter; ++i) {
      Corner corner = NoisyCorner({Uniform(random_, 8, 743), Uniform(random_, 8, 471)}, 4);
      corner.descriptor = RandomDescriptor(random_);
      keyframe->corners.push_back(corner);
      point_of_corner.push_back(-1);
    }
    return point_of_corner;
  }

  // Near points are described on coarser octaves, where pixels are less accurate.
  Corner NoisyCorner(const Eigen::Vector2d& pixel, double depth) {
    constexpr double kFarDepth = 8;
    Corner corner;
    corner.octave = static_cast<int8_t>(
        std::clamp(std::log(kFarDepth / depth) / std::log(kOctaveScale) / 3, 0.0, 3.0));
    const double sigma = CornerSigma(corner, options_.pixel_sigma);
    corner.pixel =
        (pixel + Eigen::Vector2d(Normal(random_, sigma), Normal(random_, sigma))).cast<float>();
    return corner;
  }

  const SyntheticWorldOptions& options_;
  const std::vector<SyntheticPoint>& points_;
  Random& random_;
  SyntheticAgent agent_;
  double start_ = 0;
  double phases_[6] = {};
  std::vector<bool> tracked_;
  double yaw_odom_hall_ = 0;
  Eigen::Vector3d tilt_ = Eigen::Vector3d::Zero();
};

Constraint MakeConstraint(const SyntheticWorld& world, const KeyframeId& from, const KeyframeId& to,
                          const SyntheticConstraintOptions& options, Random& random) {
  Constraint constraint;
  constraint.from = from;
  constraint.to = to;
  constraint.kind = from.map == to.map ? PlaceKind::kIntra : PlaceKind::kInter;
  constraint.accepted = true;
  constraint.num_inliers = options.num_inliers;
  constraint.inlier_ratio = 0.8;
  constraint.rms_px = 1;
  // covariance = A A^T, with A lower triangular: rotation errors leak into the translation.
  Vector6d sigmas;
  sigmas << Eigen::Vector3d::Constant(options.sigma_m),
      Eigen::Vector3d::Constant(options.sigma_rad);
  Matrix6d mix = Matrix6d::Identity();
  for (int row = 0; row < 6; ++row) {
    for (int column = 0; column < row; ++column) {
      mix(row, column) = Uniform(random, -0.5, 0.5);
    }
  }
  const Matrix6d A = sigmas.asDiagonal() * mix;
  constraint.covariance = A * A.transpose();
  Vector6d unit;
  unit << NormalVector(random, 1), NormalVector(random, 1);
  constraint.T_from_to = (world.T_hall_body(from).Inverse() * world.T_hall_body(to)).Plus(A * unit);
  return constraint;
}

}  // namespace

const Rigid3& SyntheticWorld::T_hall_body(const KeyframeId& id) const {
  const auto agent = std::ranges::find(agents, id.map, &SyntheticAgent::map);
  return agent->T_hall_body.at(id.seq);
}

SyntheticWorld MakeSyntheticWorld(const SyntheticWorldOptions& options) {
  Random random(options.seed);
  SyntheticWorld world;
  world.points = MakePoints(options, random);
  for (int i = 0; i < options.num_agents; ++i) {
    world.agents.push_back(AgentWalk(options, world.points, i, random).Run());
  }
  return world;
}

Constraint MakeTrueConstraint(const SyntheticWorld& world, const KeyframeId& from,
                              const KeyframeId& to, const SyntheticConstraintOptions& options,
                              std::mt19937_64& random) {
  return MakeConstraint(world, from, to, options, random);
}

Constraint MakeFalseConstraint(const SyntheticWorld& world, const KeyframeId& from,
                               const KeyframeId& to, const SyntheticConstraintOptions& options,
                               std::mt19937_64& random) {
  Constraint constraint = MakeConstraint(world, from, to, options, random);
  const double bearing = Uniform(random, -pi, pi);
  const Eigen::Vector3d off(std::cos(bearing), std::sin(bearing), 0.1);
  constraint.T_from_to.t += Uniform(random, 2, 6) * off;
  // The rotation error is about gravity; otherwise a check of roll and pitch would find it.
  const Eigen::Vector3d up = world.T_hall_body(from).q.conjugate() * Eigen::Vector3d::UnitZ();
  constraint.T_from_to.q =
      (ExpSo3(Uniform(random, -0.6, 0.6) * up) * constraint.T_from_to.q).normalized();
  return constraint;
}

std::vector<OverlappingPair> OverlappingPairs(const SyntheticWorld& world, double distance_m,
                                              int min_seq_gap) {
  constexpr double kMinViewCosine = 0.8;
  std::vector<const Keyframe*> keyframes;
  for (const SyntheticAgent& agent : world.agents) {
    for (const Keyframe& keyframe : agent.keyframes) {
      keyframes.push_back(&keyframe);
    }
  }
  std::vector<OverlappingPair> pairs;
  for (size_t i = 0; i < keyframes.size(); ++i) {
    const Rigid3& T_i = world.T_hall_body(keyframes[i]->id);
    for (size_t j = i + 1; j < keyframes.size(); ++j) {
      const Rigid3& T_j = world.T_hall_body(keyframes[j]->id);
      const bool recent = keyframes[i]->id.map == keyframes[j]->id.map &&
                          keyframes[j]->id.seq - keyframes[i]->id.seq < min_seq_gap;
      const double view_cosine =
          (T_i.q * Eigen::Vector3d::UnitX()).dot(T_j.q * Eigen::Vector3d::UnitX());
      if (!recent && (T_i.t - T_j.t).norm() < distance_m && view_cosine > kMinViewCosine) {
        pairs.push_back({keyframes[i]->id, keyframes[j]->id});
      }
    }
  }
  return pairs;
}

void Unscale(double log_scale, double sigma, SyntheticAgent* agent) {
  const double longer = std::exp(-log_scale);
  for (Keyframe& keyframe : agent->keyframes) {
    keyframe.T_odom_body.t *= longer;
    keyframe.scale_sigma = sigma;
    for (MapPoint& point : keyframe.points) {
      point.inverse_depth /= static_cast<float>(longer);
      point.inverse_depth_var /= static_cast<float>(longer * longer);
    }
    if (keyframe.edge) {
      keyframe.edge->T_from_this.t *= longer;
      keyframe.edge->covariance.topRows<3>() *= longer;
      keyframe.edge->covariance.leftCols<3>() *= longer;
    }
  }
}

void Unscale(double log_scale, const MapId& map, std::vector<Constraint>* constraints) {
  const double longer = std::exp(-log_scale);
  for (Constraint& constraint : *constraints) {
    if (constraint.from.map == map && constraint.to.map == map) {
      constraint.T_from_to.t *= longer;
      constraint.covariance.topRows<3>() *= longer;
      constraint.covariance.leftCols<3>() *= longer;
    }
  }
}

}  // namespace pangea
