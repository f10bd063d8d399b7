#include "loop_verification/tags/tag_places.h"

#include <Eigen/LU>
#include <vector>

#include "core/tags/tag_place.h"
#include "loop_verification/tags/planar_pose.h"
#include "loop_verification/window.h"

namespace pangea {
namespace {

constexpr double kDirectionSigma = 0.003;  // radians: of the corners and of the odometry
constexpr double kRangeSigma = 0.05;       // share of the range: of how large a tag looks

struct TagRay {
  Eigen::Vector3d origin_w, direction_w;
  std::optional<double> range_m;
};

// Distance of the tag's centre by its looks.
std::optional<double> RangeOf(const TagObservation& tag, const CameraModel& camera,
                              std::optional<double> size_m) {
  std::array<Eigen::Vector2d, kTagCorners> rays;
  for (size_t i = 0; i < rays.size(); ++i) {
    const auto ray = camera.Unproject(tag.corners[i].cast<double>());
    if (!ray || !size_m) {
      return std::nullopt;
    }
    rays[i] = *ray;
  }
  const std::vector<Rigid3> poses = PosesOfSquare(rays);
  return poses.empty() ? std::nullopt : std::optional(0.5 * *size_m * poses[0].t.norm());
}

// The errors of several views of one window are nearly the same, so they count as one.
std::optional<PlacedTag> PlaceOf(const std::vector<TagRay>& rays) {
  TagRays crossing;
  for (const TagRay& ray : rays) {
    crossing.Add(ray.origin_w, ray.direction_w);
  }
  const auto place = crossing.Place();
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  Eigen::Vector3d weighted = Eigen::Vector3d::Zero();
  for (const TagRay& ray : rays) {
    if (!ray.range_m && !place) {
      return std::nullopt;
    }
    const double range = ray.range_m ? *ray.range_m : (place->p - ray.origin_w).norm();
    const Eigen::Matrix3d along = ray.direction_w * ray.direction_w.transpose();
    const double across_sigma = kDirectionSigma * range, along_sigma = kRangeSigma * range;
    Eigen::Matrix3d of_ray = (Eigen::Matrix3d::Identity() - along) / (across_sigma * across_sigma);
    if (ray.range_m) {
      of_ray += along / (along_sigma * along_sigma);
    }
    information += of_ray;
    weighted += of_ray * (ray.origin_w + range * ray.direction_w);
  }
  PlacedTag placed;
  placed.p_w = information.inverse() * weighted;
  placed.covariance = static_cast<double>(rays.size()) * information.inverse();
  return placed;
}

}  // namespace

std::map<TagId, std::optional<PlacedTag>> PlaceTags(const KeyframeWindow& frames,
                                                    const TagSizes& sizes) {
  const std::vector<Rigid3> T_w_body = PosesAlongEdges(frames);
  std::map<TagId, std::vector<TagRay>> rays;
  for (size_t i = 0; i < frames.size(); ++i) {
    const Keyframe& keyframe = frames[i]->keyframe();
    const Rigid3 T_w_cam = T_w_body[i] * keyframe.camera.T_body_cam;
    for (const TagObservation& tag : keyframe.tags) {
      if (const auto direction = DirectionTo(tag, keyframe.camera)) {
        rays[tag.tag].push_back(
            {T_w_cam.t, T_w_cam.q * *direction, RangeOf(tag, keyframe.camera, sizes.Of(tag.tag))});
      }
    }
  }
  std::map<TagId, std::optional<PlacedTag>> places;
  for (const auto& [tag, of_tag] : rays) {
    places[tag] = PlaceOf(of_tag);
  }
  return places;
}

}  // namespace pangea
