#include "core/keyframe_record.h"

#include <gtest/gtest.h>

#include <cstring>

namespace pangea {
namespace {

Keyframe Full() {
  Keyframe keyframe;
  keyframe.id = {{3, 1234567890123}, 17};
  keyframe.utime = 42;
  keyframe.camera.kind = CameraModel::Kind::kEquidistant;
  keyframe.camera.width = 640;
  keyframe.camera.height = 480;
  keyframe.camera.fx = 401.25;
  keyframe.camera.fy = 402.25;
  keyframe.camera.cx = 320.5;
  keyframe.camera.cy = 240.5;
  keyframe.camera.time_offset_s = -0.004;
  keyframe.camera.distortion = {0.1, -0.2, 0.3, -0.4};
  keyframe.camera.T_body_cam = {YawRotation(0.3), {0.1, 0.2, 0.3}};
  keyframe.camera.readout_s = 0.03;
  keyframe.T_odom_body = {YawRotation(1.0 / 3), {1.0 / 3, 2, 3}};
  keyframe.v_odom_body = {0.1, 0.2, 0.3};
  keyframe.gyro_bias = {0.01, 0.02, 0.03};
  keyframe.accel_bias = {0.3, 0.2, 0.1};
  keyframe.roll_pitch_covariance << 2e-4, 1e-5, 1e-5, 3e-4;
  keyframe.scale_sigma = 0.07;
  keyframe.T_body_cam_covariance(2, 4) = 1e-6;
  keyframe.edge = OdometryEdge{16, {YawRotation(0.01), {0.2, 0, 0}}, Matrix6d::Identity() * 0.7};
  keyframe.preintegration.emplace();
  keyframe.preintegration->duration_s = 0.25;
  keyframe.preintegration->delta_q = YawRotation(0.02);
  keyframe.preintegration->delta_v = {4, 5, 6};
  keyframe.preintegration->delta_p = {7, 8, 9};
  keyframe.preintegration->gyro_bias = {0.1, 0.2, 0.3};
  keyframe.preintegration->accel_bias = {0.4, 0.5, 0.6};
  keyframe.preintegration->covariance(2, 5) = 0.125;
  keyframe.preintegration->bias_jacobian(8, 5) = -3;
  keyframe.corners.resize(3);
  keyframe.corners[1] = {{100.0625F, 3.5F}, 4, {1, 2, 3, ~uint64_t{0}}, 99};
  keyframe.points = {{1, 0.5F, 0.01F}, {2, 0.25F, 0.02F}};
  keyframe.tags = {{{TagFamily::k36h11, 17}, {{{1, 2}, {3, 2}, {3, 1}, {1, 1.25F}}}}};
  keyframe.group_revision = 5;
  return keyframe;
}

TEST(KeyframeRecord, ComesBackToTheLastBit) {
  const Keyframe keyframe = Full();
  const std::vector<uint8_t> record = ToRecord(keyframe);
  const auto back = KeyframeFromRecord(record);
  ASSERT_TRUE(back);
  EXPECT_EQ(back->id, keyframe.id);
  EXPECT_EQ(back->utime, keyframe.utime);
  EXPECT_EQ(back->camera.kind, keyframe.camera.kind);
  EXPECT_EQ(back->camera.width, keyframe.camera.width);
  EXPECT_EQ(back->camera.height, keyframe.camera.height);
  EXPECT_EQ(back->camera.fx, keyframe.camera.fx);
  EXPECT_EQ(back->camera.fy, keyframe.camera.fy);
  EXPECT_EQ(back->camera.cx, keyframe.camera.cx);
  EXPECT_EQ(back->camera.cy, keyframe.camera.cy);
  EXPECT_EQ(back->camera.time_offset_s, keyframe.camera.time_offset_s);
  EXPECT_EQ(back->camera.readout_s, keyframe.camera.readout_s);
  EXPECT_EQ(back->v_odom_body, keyframe.v_odom_body);
  EXPECT_EQ(back->scale_sigma, keyframe.scale_sigma);
  EXPECT_EQ(back->T_body_cam_covariance, keyframe.T_body_cam_covariance);
  EXPECT_EQ(back->gyro_bias, keyframe.gyro_bias);
  EXPECT_EQ(back->accel_bias, keyframe.accel_bias);
  EXPECT_EQ(back->camera.distortion, keyframe.camera.distortion);
  EXPECT_EQ(back->camera.T_body_cam.q.coeffs(), keyframe.camera.T_body_cam.q.coeffs());
  EXPECT_EQ(back->camera.T_body_cam.t, keyframe.camera.T_body_cam.t);
  EXPECT_EQ(back->T_odom_body.q.coeffs(), keyframe.T_odom_body.q.coeffs());
  EXPECT_EQ(back->T_odom_body.t, keyframe.T_odom_body.t);
  EXPECT_EQ(back->roll_pitch_covariance, keyframe.roll_pitch_covariance);
  ASSERT_TRUE(back->edge);
  EXPECT_EQ(back->edge->from_seq, 16);
  EXPECT_EQ(back->edge->T_from_this.q.coeffs(), keyframe.edge->T_from_this.q.coeffs());
  EXPECT_EQ(back->edge->T_from_this.t, keyframe.edge->T_from_this.t);
  EXPECT_EQ(back->edge->covariance, keyframe.edge->covariance);
  ASSERT_TRUE(back->preintegration);
  EXPECT_EQ(back->preintegration->duration_s, 0.25);
  EXPECT_EQ(back->preintegration->delta_q.coeffs(), keyframe.preintegration->delta_q.coeffs());
  EXPECT_EQ(back->preintegration->delta_v, keyframe.preintegration->delta_v);
  EXPECT_EQ(back->preintegration->delta_p, keyframe.preintegration->delta_p);
  EXPECT_EQ(back->preintegration->gyro_bias, keyframe.preintegration->gyro_bias);
  EXPECT_EQ(back->preintegration->accel_bias, keyframe.preintegration->accel_bias);
  EXPECT_EQ(back->preintegration->covariance, keyframe.preintegration->covariance);
  EXPECT_EQ(back->preintegration->bias_jacobian, keyframe.preintegration->bias_jacobian);
  ASSERT_EQ(back->corners.size(), 3u);
  EXPECT_EQ(back->corners[1].pixel, keyframe.corners[1].pixel);
  EXPECT_EQ(back->corners[1].octave, 4);
  EXPECT_EQ(back->corners[1].descriptor, keyframe.corners[1].descriptor);
  EXPECT_EQ(back->corners[1].landmark_id, 99);
  ASSERT_EQ(back->points.size(), 2u);
  EXPECT_EQ(back->points[1].corner, 2);
  EXPECT_EQ(back->points[1].inverse_depth, 0.25F);
  EXPECT_EQ(back->points[1].inverse_depth_var, 0.02F);
  ASSERT_EQ(back->tags.size(), 1u);
  EXPECT_EQ(back->tags[0].tag, keyframe.tags[0].tag);
  EXPECT_EQ(back->tags[0].corners, keyframe.tags[0].corners);
  EXPECT_EQ(back->group_revision, 5);
  EXPECT_EQ(ToRecord(*back), record);
}

TEST(KeyframeRecord, WithoutEdgeAndPreintegration) {
  Keyframe keyframe = Full();
  keyframe.edge.reset();
  keyframe.preintegration.reset();
  keyframe.corners.clear();
  keyframe.points.clear();
  const auto back = KeyframeFromRecord(ToRecord(keyframe));
  ASSERT_TRUE(back);
  EXPECT_FALSE(back->edge);
  EXPECT_FALSE(back->preintegration);
  EXPECT_TRUE(back->corners.empty());
}

TEST(KeyframeRecord, WhatIsNoneIsRefused) {
  const std::vector<uint8_t> record = ToRecord(Full());
  for (size_t size = 0; size < record.size(); ++size) {
    EXPECT_FALSE(KeyframeFromRecord(std::span(record).first(size))) << size;
  }
  std::vector<uint8_t> longer = record;
  longer.push_back(0);
  EXPECT_FALSE(KeyframeFromRecord(longer));
}

// A damaged count allocates no more memory than the record fills; no index points outside of it.
TEST(KeyframeRecord, HostileSizes) {
  const std::vector<uint8_t> record = ToRecord(Full());
  const uint32_t huge = 0x7fffffff;
  for (size_t at = 0; at + sizeof(huge) <= record.size(); ++at) {
    std::vector<uint8_t> hostile = record;
    std::memcpy(hostile.data() + at, &huge, sizeof(huge));
    const auto keyframe = KeyframeFromRecord(hostile);
    if (keyframe) {
      EXPECT_EQ(keyframe->corners.size(), 3u);
      for (const MapPoint& point : keyframe->points) {
        EXPECT_LT(point.corner, 3);
      }
    }
  }
}

}  // namespace
}  // namespace pangea
