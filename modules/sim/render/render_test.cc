// Tests textures, renderer, sensor, scenes and tracks.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>

#include "core/testing/test_cameras.h"
#include "sim/random.h"
#include "sim/render/cameras.h"
#include "sim/render/renderer.h"
#include "sim/render/sensor.h"
#include "sim/render/tracks.h"
#include "sim/scene/route.h"
#include "sim/scene/scene_builder.h"
#include "sim/scene/test_scenes.h"

namespace pangea::sim {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// A camera that looks along +x of the reference, with an additional small rotation.
Rigid3 LookAlongX(const Vector3d& rotation, const Vector3d& at) {
  return {LookingAhead() * ExpSo3(rotation), at};
}

// The window around a pixel, less its background (the grey at its corner).
cv::Mat Window(const cv::Mat& grey, const Vector2d& middle) {
  constexpr int kHalf = 25;
  cv::Mat window;
  grey(cv::Rect(static_cast<int>(middle.x()) - kHalf, static_cast<int>(middle.y()) - kHalf,
                2 * kHalf + 1, 2 * kHalf + 1))
      .convertTo(window, CV_32F);
  window -= window.at<float>(0, 0);
  return window;
}

// Centre and variances of the window's bright part, in pixels of the whole image.
struct Blob {
  Vector2d centre = Vector2d::Zero();
  Vector2d variance = Vector2d::Zero();
};

Blob BlobNear(const cv::Mat& grey, const Vector2d& middle) {
  const cv::Mat window = Window(grey, middle);
  double weight = 0;
  Vector2d sum = Vector2d::Zero();
  Vector2d sum2 = Vector2d::Zero();
  for (int y = 0; y < window.rows; ++y) {
    for (int x = 0; x < window.cols; ++x) {
      // Vignetting and the wall's seams with its neighbours are no part of the blob.
      const double w = std::max(window.at<float>(y, x) - 5.0, 0.0);
      weight += w;
      sum += w * Vector2d(x, y);
      sum2 += w * Vector2d(x * x, y * y);
    }
  }
  const Vector2d mean = sum / weight;
  const Vector2d corner = middle.cast<int>().cast<double>() - Vector2d(25, 25);
  return {corner + mean, sum2 / weight - mean.cwiseAbs2()};
}

SceneOptions CoarseScene(SceneKind kind, uint64_t seed) {
  SceneOptions options;
  options.kind = kind;
  options.seed = seed;
  options.coarseness = 8;
  return options;
}

TEST(Texture, FarAwayAFineCheckerboardIsEvenGrey) {
  cv::Mat board(256, 256, CV_8U);
  for (int y = 0; y < board.rows; ++y) {
    for (int x = 0; x < board.cols; ++x) {
      board.at<uint8_t>(y, x) = (x + y) % 2 == 0 ? 0 : 254;
    }
  }
  const Texture texture(board, 0.01f, true);
  Rng rng(3, "checkerboard");
  for (int i = 0; i < 200; ++i) {
    Footprint f{.u = static_cast<float>(rng.Uniform(0, 5)),
                .v = static_cast<float>(rng.Uniform(0, 5))};
    f.minor = 0.02f;  // two texels
    f.major = 0.06f;
    EXPECT_NEAR(texture.Sample(f), 127, 2);
    f.minor = f.major = 0.001f;  // a tenth of a texel: contrast is there
  }
  const Footprint dark{.u = 0.005f, .v = 0.005f, .major = 0.001f, .minor = 0.001f};
  const Footprint bright{.u = 0.015f, .v = 0.005f, .major = 0.001f, .minor = 0.001f};
  EXPECT_NEAR(texture.Sample(dark), 0, 2);
  EXPECT_NEAR(texture.Sample(bright), 254, 2);
}

TEST(Renderer, AKnownPointAppearsWhereTheCameraModelSays) {
  const Scene scene = RoomWithDisc(60, 200);
  for (const CameraModel& camera : {EurocCamera(), PhoneCamera(), WideCamera()}) {
    const Renderer renderer(scene, camera);
    Rng rng(4, "poses");
    for (int i = 0; i < 4; ++i) {
      const Vector3d rotation(rng.Uniform(-0.3, 0.3), rng.Uniform(-0.3, 0.3), rng.Uniform(-1, 1));
      const Vector3d at(rng.Uniform(-1, 2), rng.Uniform(-1, 1), rng.Uniform(-1, 1));
      const Rigid3 T_ref_cam = LookAlongX(rotation, at);
      const auto expected = camera.Project(T_ref_cam.Inverse() * kDisc);
      if (!expected || !camera.Contains(*expected, 30)) {
        continue;
      }
      const RenderedView view = renderer.Render({T_ref_cam});
      // A disc seen aslant has its centre a little off the image's; some hundredths of a pixel.
      EXPECT_LT((BlobNear(view.grey, *expected).centre - *expected).norm(), 0.1);
      const float range = view.range.at<float>(static_cast<int>(std::lround(expected->y())),
                                               static_cast<int>(std::lround(expected->x())));
      EXPECT_NEAR(range, (kDisc - at).norm(), 0.03);
    }
  }
}

TEST(Renderer, SubpixelMotionMovesTheImageSmoothly) {
  const Scene scene = RoomWithDisc(60, 200);
  const CameraModel camera = Shrunk(EurocCamera(), 2);
  const Renderer renderer(scene, camera);
  for (int i = 0; i < 8; ++i) {
    const Vector3d rotation(0, 0.3 * i * camera.PixelAngle(), 0);
    const Rigid3 T_ref_cam = LookAlongX(rotation, Vector3d::Zero());
    const RenderedView view = renderer.Render({T_ref_cam});
    const Vector2d expected = *camera.Project(T_ref_cam.Inverse() * kDisc);
    EXPECT_LT((BlobNear(view.grey, expected).centre - expected).norm(), 0.08);
  }
}

TEST(Renderer, TilesMissNothingThatASingleRaySees) {
  const Scene scene = BuildScene(CoarseScene(SceneKind::kRoom, 5));
  for (const CameraModel& camera : {Shrunk(EurocCamera(), 4), Shrunk(PhoneCamera(), 4)}) {
    std::vector<Rigid3> rows;
    const bool rolling = camera.readout_s > 0;
    for (int y = 0; y < (rolling ? camera.height : 1); ++y) {
      rows.push_back(LookAlongX({0, 0.001 * y, 0}, {0.002 * y, 0.1, 1.3}));
    }
    const RenderedView view = Renderer(scene, camera).Render(rows);
    for (int y = 0; y < camera.height; y += 3) {
      for (int x = 0; x < camera.width; x += 3) {
        const Rigid3& T = rows[rolling ? static_cast<size_t>(y) : 0];
        const auto xy = camera.Unproject({x, y});
        ASSERT_TRUE(xy);
        const Vector3d direction = T.q * xy->homogeneous().normalized();
        const auto hit = scene.Cast(T.t.cast<float>(), direction.cast<float>());
        ASSERT_TRUE(hit);
        // At a silhouette rounding decides; elsewhere both are the same.
        const float range = view.range.at<float>(y, x);
        if (std::abs(range - hit->range) > 1e-3f) {
          ADD_FAILURE() << "pixel " << x << " " << y << ": " << range << " instead of "
                        << hit->range;
        }
      }
    }
  }
}

TEST(Sensor, BlurIsAsLongAsTheMotion) {
  const Scene scene = RoomWithDisc(60, 200);
  const CameraModel camera = EurocCamera();
  const Rigid3 T_ref_cam = LookAlongX(Vector3d::Zero(), Vector3d::Zero());
  const RenderedView view = Renderer(scene, camera).Render({T_ref_cam});
  SensorOptions options{.exposure_s = 0.01, .vignetting = 0};
  // 1 rad/s about the camera's y for 10 ms is 4.6 pixels along x.
  const cv::Mat blurred = Sensor(camera, options).NoiseFree(view, {.omega_cam = {0, 1, 0}});
  options.exposure_s = 0;
  const cv::Mat sharp = Sensor(camera, options).NoiseFree(view, {.omega_cam = {0, 1, 0}});
  const Vector2d middle = *camera.Project(T_ref_cam.Inverse() * kDisc);
  const Vector2d blurred_variance = BlobNear(blurred, middle).variance;
  const Vector2d sharp_variance = BlobNear(sharp, middle).variance;
  // A box of length L adds L^2 / 12 to the variance.
  const double length = 0.01 * camera.fx;
  EXPECT_NEAR(blurred_variance.x() - sharp_variance.x(), length * length / 12, 0.6);
  EXPECT_NEAR(blurred_variance.y(), sharp_variance.y(), 0.3);
}

TEST(Sensor, NoiseHasItsVarianceAndItsSeed) {
  CameraModel camera = EurocCamera();
  SensorOptions options{.gain_variation = 0, .read_noise = 2, .shot_noise = 0.2};
  const Sensor sensor(camera, options);
  const cv::Mat even(camera.height, camera.width, CV_8U, cv::Scalar(100));
  const cv::Mat picture = sensor.Develop(even, 1, 0, 7);
  double sum = 0, sum2 = 0;
  for (int y = 0; y < picture.rows; ++y) {
    for (int x = 0; x < picture.cols; ++x) {
      const double v = picture.at<uint8_t>(y, x) - 100.0;
      sum += v;
      sum2 += v * v;
    }
  }
  const auto n = static_cast<double>(picture.total());
  EXPECT_NEAR(sum / n, 0, 0.02);
  EXPECT_NEAR(sum2 / n, 4 + 0.04 * 100 + 1.0 / 12, 0.15);  // and rounding
  const auto differs = [&](const cv::Mat& other) {
    return cv::norm(other, picture, cv::NORM_L1) > 0;
  };
  EXPECT_FALSE(differs(sensor.Develop(even, 1, 0, 7)));
  EXPECT_TRUE(differs(sensor.Develop(even, 2, 0, 7)));
  EXPECT_TRUE(differs(sensor.Develop(even, 1, 0, 8)));
}

TEST(Scene, StaysClearOfThePathsItIsBuiltAround) {
  SceneOptions options = CoarseScene(SceneKind::kHall, 1);
  for (const StampedPose& pose : LivelyPath(20)) {
    options.keep_clear.push_back(4 * pose.T.t + Vector3d(3, 1, 0));
  }
  const Scene scene = BuildScene(options);
  EXPECT_GT(scene.primitives.size(), 50u);
  for (const Vector3d& p : options.keep_clear) {
    for (int axis = 0; axis < 3; ++axis) {
      EXPECT_GT(p[axis], scene.room_min[axis] + 0.5);
      EXPECT_LT(p[axis], scene.room_max[axis] - 0.5);
    }
    for (const Primitive& primitive : scene.primitives) {
      // Points are thinned to cubes of 0.2 m before the check, so a piece may be up to 0.35 m
      // nearer.
      EXPECT_GT(primitive.Distance(p.cast<float>()), options.clearance_m - 0.35);
    }
  }
}

TEST(Scene, ASeedChangesEverything) {
  const Scene a = BuildScene(CoarseScene(SceneKind::kRoom, 1));
  const Scene again = BuildScene(CoarseScene(SceneKind::kRoom, 1));
  const Scene b = BuildScene(CoarseScene(SceneKind::kRoom, 2));
  EXPECT_EQ(a.primitives.size(), again.primitives.size());
  EXPECT_EQ(a.primitives[3].p_ref, again.primitives[3].p_ref);
  EXPECT_NE(a.room_max, b.room_max);
  EXPECT_NE(a.primitives[3].p_ref, b.primitives[3].p_ref);
  const Footprint f{.u = 1, .v = 1, .major = 0.01f, .minor = 0.01f};
  const auto wall = [&](const Scene& scene, size_t i) {
    return scene.surfaces[static_cast<size_t>(scene.room_surfaces[i])].texture.Sample(f);
  };
  int same = 0;
  for (size_t i = 0; i < 6; ++i) {
    EXPECT_EQ(wall(a, i), wall(again, i));
    same += wall(a, i) == wall(b, i) ? 1 : 0;
  }
  EXPECT_LT(same, 3);
}

float GreyOf(const Scene& scene, const Primitive& p, float u) {
  const Footprint f{.u = u, .v = 0.1f, .major = 0.05f, .minor = 0.05f};
  return scene.surfaces[static_cast<size_t>(p.surfaces[0])].texture.Sample(f);
}

TEST(Scene, TwinRoomsShareADozenObjectsAtDifferentPlaces) {
  const Scene a = BuildScene(CoarseScene(SceneKind::kTwinObjectsA, 1));
  const Scene b = BuildScene(CoarseScene(SceneKind::kTwinObjectsB, 1));
  EXPECT_NE(a.room_max, b.room_max);
  int shared = 0;
  for (const Primitive& p : a.primitives) {
    for (const Primitive& q : b.primitives) {
      if (p.half == q.half) {
        ++shared;
        EXPECT_GT((p.p_ref - q.p_ref).norm(), 0.05);
        EXPECT_EQ(GreyOf(a, p, 0.05f), GreyOf(b, q, 0.05f));
        EXPECT_EQ(GreyOf(a, p, 0.15f), GreyOf(b, q, 0.15f));
      }
    }
  }
  EXPECT_GE(shared, 20);  // each has two parts; one of the dozen may find no place
}

TEST(Scene, HallsWithRowsRepeatTheSameMachinesWithinAndAcross) {
  const Scene a = BuildScene(CoarseScene(SceneKind::kRowsA, 1));
  const Scene b = BuildScene(CoarseScene(SceneKind::kRowsB, 1));
  EXPECT_NE(a.room_max, b.room_max);
  const auto copies = [&](const Primitive& p, const Scene& scene) {
    return std::ranges::count_if(scene.primitives, [&](const Primitive& q) {
      return p.half == q.half && GreyOf(a, p, 0.05f) == GreyOf(scene, q, 0.05f);
    });
  };
  const auto repeated = std::ranges::count_if(
      a.primitives, [&](const Primitive& p) { return copies(p, a) >= 4 && copies(p, b) >= 4; });
  EXPECT_GT(2 * static_cast<size_t>(repeated), a.primitives.size());
}

TEST(Scene, ABareHallHasAFractionOfTheMarks) {
  // The mean change of grey over 3 cm on the room's own sheets.
  const auto roughness = [](SceneKind kind) {
    const Scene scene = BuildScene(CoarseScene(kind, 1));
    double sum = 0;
    constexpr int kSamples = 300;
    for (const int surface : scene.room_surfaces) {
      Footprint f{.v = 1, .major = 0.02f, .minor = 0.02f};
      float before = 0;
      for (int i = 0; i <= kSamples; ++i) {
        f.u = 1 + 0.03f * static_cast<float>(i);
        const float grey = scene.surfaces[static_cast<size_t>(surface)].texture.Sample(f);
        sum += i > 0 ? std::abs(grey - before) / (6 * kSamples) : 0;
        before = grey;
      }
    }
    return sum;
  };
  EXPECT_LT(roughness(SceneKind::kBareHall), 0.4 * roughness(SceneKind::kHall));
}

TEST(Tracks, ArePersistentVisibleAndWhereTheCameraSeesThem) {
  const Scene scene = BuildScene(CoarseScene(SceneKind::kRoom, 3));
  const CameraModel camera = EurocCamera();
  TrackMaker tracks(scene, camera, 150, 1);
  std::vector<TrackedPoint> before;
  for (int i = 0; i < 5; ++i) {
    const Rigid3 T_ref_cam = LookAlongX({0, 0.02 * i, 0}, {0.03 * i, 0, 1.2});
    const std::vector<TrackedPoint> points = tracks.Next({T_ref_cam});
    EXPECT_GT(points.size(), 100u);
    size_t kept = 0;
    for (const TrackedPoint& point : points) {
      const Vector3d& landmark = tracks.landmarks()[static_cast<size_t>(point.landmark_id)];
      const auto pixel = camera.Project(T_ref_cam.Inverse() * landmark);
      ASSERT_TRUE(pixel);
      EXPECT_LT((*pixel - point.pixel).norm(), 1e-9);
      const auto hit = scene.Cast(T_ref_cam.t.cast<float>(),
                                  (landmark - T_ref_cam.t).normalized().cast<float>());
      EXPECT_NEAR(hit->range, (landmark - T_ref_cam.t).norm(), 0.02);
      kept += std::ranges::count(before, point.landmark_id, &TrackedPoint::landmark_id);
    }
    if (!before.empty()) {
      EXPECT_GT(kept, 85 * points.size() / 100);
    }
    before = points;
  }
}

}  // namespace
}  // namespace pangea::sim
