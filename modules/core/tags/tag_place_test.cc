#include "core/tags/tag_place.h"

#include <gtest/gtest.h>

#include "core/testing/test_cameras.h"

namespace pangea {
namespace {

const Eigen::Vector3d kTag(5, 0.4, 1.7);

// The tag's centre, as cameras see it that look along x from these places.
TagRays SeenFrom(const std::vector<Eigen::Vector3d>& places) {
  const CameraModel camera = EurocTestCamera();
  TagRays rays;
  for (const Eigen::Vector3d& p : places) {
    const Rigid3 T_w_cam = Rigid3(YawRotation(0.05), p) * camera.T_body_cam;
    TagObservation seen;
    for (int i = 0; i < kTagCorners; ++i) {
      // Seen at an angle: the centre is not the mean of the corners.
      const Eigen::Vector3d corner(0.1 * kTagCornerSigns[i][0], -0.15 * kTagCornerSigns[i][0],
                                   -0.15 * kTagCornerSigns[i][1]);
      seen.corners[i] = camera.Project(T_w_cam.Inverse() * (kTag + corner)).value().cast<float>();
    }
    rays.Add(T_w_cam.t, T_w_cam.q * DirectionTo(seen, camera).value());
  }
  return rays;
}

TEST(TagRays, MeetAtTheTag) {
  const auto place = SeenFrom({{0, 0, 1.5}, {0.2, 0.6, 1.5}, {0.5, 1.2, 1.6}}).Place();
  ASSERT_TRUE(place);
  EXPECT_LT((place->p - kTag).norm(), 1e-3);
  EXPECT_GT(place->sigma_m, 0.01);
  EXPECT_LT(place->sigma_m, 0.1);
}

TEST(TagRays, WithoutParallaxThereIsNoPlace) {
  EXPECT_FALSE(SeenFrom({{0, 0, 1.5}}).Place());
  EXPECT_FALSE(SeenFrom({{0, 0, 1.5}, {0, 0.05, 1.5}, {0.5, 0.03, 1.5}}).Place());
}

}  // namespace
}  // namespace pangea
