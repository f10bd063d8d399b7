#pragma once

// Where a tag is, from the rays of several keyframes to its centre: its size is not needed.

#include <Eigen/Core>
#include <optional>

#include "core/keyframe.h"

namespace pangea {

// Constraint::reason of a candidate whose alignment puts different tags at one place.
inline constexpr char kDifferentTags[] = "different tags at one place";

struct TagPlace {
  Eigen::Vector3d p = Eigen::Vector3d::Zero();
  double sigma_m = 0;  // in the worst direction
};

class TagRays {
 public:
  // A ray from `origin` along the unit vector `direction`, both in one frame.
  void Add(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction);
  // In the frame of the rays; nothing if they are nearly parallel.
  std::optional<TagPlace> Place() const;

  // Calls visit(part) for each part, for records.
  template <typename Visitor>
  void Visit(const Visitor& visit) {
    VisitParts(*this, visit);
  }
  template <typename Visitor>
  void Visit(const Visitor& visit) const {
    VisitParts(*this, visit);
  }

 private:
  template <typename Rays, typename Visitor>
  static void VisitParts(Rays& rays, const Visitor& visit) {
    visit(rays.A_);
    visit(rays.b_);
    visit(rays.sum_of_origins_);
    visit(rays.count_);
  }

  // The point that is nearest to all rays solves A p = b.
  Eigen::Matrix3d A_ = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d sum_of_origins_ = Eigen::Vector3d::Zero();
  int count_ = 0;
};

// The unit vector to the tag's centre in the camera's frame; nothing if a corner cannot be
// undistorted.
std::optional<Eigen::Vector3d> DirectionTo(const TagObservation& tag, const CameraModel& camera);

}  // namespace pangea
