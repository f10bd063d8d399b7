// Two agents with exact odometry are fused at a known time; the second one shows anchors with a
// known error.

#include "report/metrics/report_anchors.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "report/report_test_world.h"

namespace pangea {
namespace {

using testing::HasSubstr;

constexpr int64_t kWall = 1'700'000'000'000'000;    // the logs' first event
constexpr int64_t kSensor = 1'400'000'000'000'000;  // the agents' sensors then
constexpr double kEnd_s = 40;
constexpr double kPlaced_s = 5.01;  // between two frames
constexpr double kFused_s = 10;
constexpr double kShown_s = 11;
const MapId kMaps[] = {{0, 0}, {1, 100}, {2, 200}, {3, 300}};
const AnchorId kSeenKettle{1, kWall + 5};
const Eigen::Vector3d kSeenPlace{2, 0.3, 5};  // in the ground truth's frame

int64_t Sensor(double s) { return kSensor + std::llround(1e6 * s); }
int64_t Wall(double s) { return kWall + std::llround(1e6 * s); }

// The cameras look along z, from either side of the place.
Rigid3 Walk(int32_t agent, double s) {
  return {YawRotation(0.02 * s * agent), {0.1 * s, 0.2 * agent, 0.02 * std::sin(s)}};
}

using Offset = std::function<Eigen::Vector3d(double s)>;
Eigen::Vector3d None(double) { return Eigen::Vector3d::Zero(); }

struct World {
  CapturedSession session;
  std::map<int32_t, AnchorTrack> tracks;
  std::map<int32_t, std::map<MapId, Trajectory>> odometry;
  std::map<int32_t, Trajectory> ground_truth;
  std::map<int32_t, std::set<MapId>> recording_maps;

  World() {
    session.begin_utime = kWall;
    CameraModel camera;
    camera.width = 1280;
    camera.height = 960;
    camera.fx = camera.fy = 800;
    camera.cx = 640;
    camera.cy = 480;
    for (const int32_t agent : {1, 2, 3}) {
      tracks[agent];
      recording_maps[agent] = {kMaps[agent]};
      session.cameras[agent] = camera;
      for (int i = 0; i <= 4000; ++i) {
        ground_truth[agent].push_back({Sensor(0.01 * i), Walk(agent, 0.01 * i)});
      }
      for (int i = 0; i <= 800; ++i) {
        const double s = 0.05 * i;
        odometry[agent][kMaps[agent]].push_back({Sensor(s), OdomFromTruth(agent) * Walk(agent, s)});
      }
    }
    Change(kFused_s, {1, 2});
  }

  void Change(double s, const std::vector<int32_t>& agents) {
    GroupChange change;
    change.session_s = s;
    for (const int32_t agent : agents) {
      change.maps.push_back(kMaps[agent]);
    }
    session.changes.push_back(change);
  }

  void Place(int64_t revision, double s, const Eigen::Vector3d& p_truth) {
    AnchorEdit edit;
    edit.anchor = kSeenKettle;
    edit.agent_id = 1;
    edit.revision = revision;
    edit.name = "kettle";
    edit.placement = AnchorEdit::Placement::kPixel;
    edit.map = kMaps[1];
    edit.utime = Sensor(s);
    session.anchor_edits[kSeenKettle].push_back(edit);
    Hear(1, revision, s + 1, p_truth);
  }

  // Adds an ANCHOR_k message.
  void Hear(int32_t agent, int64_t revision, double s, const Eigen::Vector3d& p_truth) {
    Rigid3 T_odom_anchor;
    T_odom_anchor.t = OdomFromTruth(agent) * p_truth;
    tracks[agent].heard[kSeenKettle].push_back(
        {Wall(s), revision, false, kMaps[agent], T_odom_anchor});
  }

  // Adds SHOWN_ANCHORS_k, a new one for each frame; `offset` is in the ground truth's axes.
  void Show(int32_t agent, int64_t revision, double from_s, double to_s, const Offset& offset,
            const Eigen::Vector3d& place = kSeenPlace) {
    for (int i = 0; i <= 800; ++i) {
      const double s = 0.05 * i;
      if (s < from_s || s > to_s) {
        continue;
      }
      ShownAnchor shown{kSeenKettle, revision, {}};
      shown.T_odom_anchor.t = OdomFromTruth(agent) * (place + offset(s));
      tracks[agent].frames.push_back(
          {Sensor(s), Wall(s), kMaps[agent], OdomFromTruth(agent) * Walk(agent, s),
           std::make_shared<const ShownAnchors>(ShownAnchors{Sensor(s), kMaps[agent], {shown}})});
    }
  }

  std::vector<AnchorMetrics> All(const std::vector<WantedAnchor>& wanted = {}) const {
    std::vector<AnchorViewer> viewers;
    for (const auto& [agent, track] : tracks) {
      viewers.push_back(
          {agent, &track, &odometry.at(agent), &ground_truth.at(agent), &recording_maps.at(agent)});
    }
    return AnchorsOf(session, viewers, wanted);
  }
  // The result for the only anchor, at the only other agent of its group.
  AnchorAtAgent AtSecond() const {
    const auto all = All();
    EXPECT_EQ(all.size(), 1u);
    EXPECT_EQ(all.at(0).agents.size(), 1u);
    EXPECT_EQ(all.at(0).agents.at(0).agent, 2);
    return all.at(0).agents.at(0);
  }
};

TEST(ReportAnchors, WhatIsShownWhereItIsHasNoError) {
  World world;
  world.Place(1, kPlaced_s, kSeenPlace);
  world.Hear(2, 1, 10.5, kSeenPlace);
  world.Show(2, 1, kShown_s, kEnd_s, None);
  const AnchorMetrics kettle = world.All().at(0);
  EXPECT_EQ(kettle.id, kSeenKettle);
  EXPECT_EQ(kettle.name, "kettle");
  EXPECT_EQ(kettle.made_by, 1);
  EXPECT_TRUE(kettle.placed);
  const AnchorAtAgent at = world.AtSecond();
  EXPECT_EQ(at.reason, "");
  // The truth is interpolated, with an error of 1e-5 m at this rotation rate.
  for (const auto& error : {at.error_m, at.error_at_fusion_m, at.error_10s_m, at.error_end_m,
                            at.error_max_m, at.error_unblended_m}) {
    EXPECT_LT(error.value(), 2e-5);
  }
  EXPECT_LT(at.error_px.value(), 0.01);
  EXPECT_LT(at.largest_jump_m.value(), 1e-9);
}

TEST(ReportAnchors, AKnownOffsetIsTheError) {
  World world;
  world.Place(1, kPlaced_s, kSeenPlace);
  world.Hear(2, 1, 10.5, kSeenPlace + Eigen::Vector3d(0, 0.01, 0));
  world.Show(2, 1, kShown_s, kEnd_s, [](double) { return Eigen::Vector3d(0.018, -0.024, 0); });
  const AnchorAtAgent at = world.AtSecond();
  EXPECT_NEAR(*at.error_m, 0.03, 2e-5);
  EXPECT_NEAR(*at.error_max_m, 0.03, 2e-5);
  EXPECT_NEAR(*at.error_unblended_m, 0.01, 2e-5);
  // The focal length is 800 px for an image 1280 px wide; the anchor is 5 m away.
  EXPECT_NEAR(*at.error_px, 0.03 * 800 / 5 / 2, 0.02);
}

TEST(ReportAnchors, OnlyWhatIsShownTenSecondsAfterTheFusionCounts) {
  World world;
  world.Place(1, kPlaced_s, kSeenPlace);
  // 0.4 m at first, 0.02 m ten seconds after the fusion, then 0.04 m, and 0.05 m in the last
  // second.
  world.Show(2, 1, kShown_s, kEnd_s, [](double s) -> Eigen::Vector3d {
    return Eigen::Vector3d::UnitX() * (s < 19.99 ? 0.4 : s < 20.01 ? 0.02 : s < 39 ? 0.04 : 0.05);
  });
  const AnchorAtAgent at = world.AtSecond();
  EXPECT_NEAR(*at.error_at_fusion_m, 0.4, 2e-5);
  EXPECT_NEAR(*at.error_10s_m, 0.02, 2e-5);
  EXPECT_NEAR(*at.error_m, 0.04, 2e-5);
  EXPECT_NEAR(*at.error_end_m, 0.05, 2e-5);
  EXPECT_NEAR(*at.error_max_m, 0.05, 2e-5);
  EXPECT_NEAR(*at.largest_jump_m, 0.38, 1e-9) << "also before it counts";
  EXPECT_FALSE(at.error_unblended_m) << "it has heard of none";
}

TEST(ReportAnchors, AStepIsAJump) {
  World world;
  world.Place(1, kPlaced_s, kSeenPlace);
  world.Show(2, 1, kShown_s, kEnd_s, [](double s) {
    return s < 25 ? Eigen::Vector3d(0.03, 0, 0.04) : Eigen::Vector3d(0.001 * (s - 25), 0, 0);
  });
  EXPECT_NEAR(*world.AtSecond().largest_jump_m, 0.05, 1e-9);
}

TEST(ReportAnchors, WhatAnEditMovedIsNoJumpAndIsTrueWhereItIsNow) {
  World world;
  const Eigen::Vector3d moved = kSeenPlace + Eigen::Vector3d(0.5, 0, 0);
  world.Place(1, kPlaced_s, kSeenPlace);
  world.Place(3, 24, moved);
  AnchorEdit renamed = world.session.anchor_edits[kSeenKettle].front();
  renamed.revision = 4;
  renamed.name = "pot";
  renamed.placement = AnchorEdit::Placement::kSame;
  world.session.anchor_edits[kSeenKettle].push_back(renamed);
  AnchorEdit forbidden = renamed;
  forbidden.revision = 5;
  forbidden.agent_id = 2;
  forbidden.right = AnchorRight::kEditOwn;
  forbidden.placement = AnchorEdit::Placement::kBody;
  world.session.anchor_edits[kSeenKettle].push_back(forbidden);
  world.Show(2, 1, kShown_s, 25, None);
  world.Show(2, 3, 25.01, 30, None, moved);
  world.Show(2, 4, 30.01, kEnd_s, None, moved);
  EXPECT_EQ(world.All().at(0).name, "pot");
  const AnchorAtAgent at = world.AtSecond();
  EXPECT_LT(*at.error_max_m, 2e-5);
  EXPECT_LT(*at.largest_jump_m, 1e-9);
}

TEST(ReportAnchors, AFusionThatWasUndoneDoesNotCount) {
  World world;
  world.Change(12, {2});
  world.Change(22, {1, 2});
  world.Place(1, kPlaced_s, kSeenPlace);
  world.Show(2, 1, kShown_s, kEnd_s, [](double s) -> Eigen::Vector3d {
    return Eigen::Vector3d::UnitX() * (s < 22 ? 1 : s < 32 ? 0.3 : 0.02);
  });
  const AnchorAtAgent at = world.AtSecond();
  EXPECT_NEAR(*at.error_at_fusion_m, 0.3, 2e-5);
  EXPECT_NEAR(*at.error_max_m, 0.02, 2e-5);
  world.Change(35, {1});
  EXPECT_TRUE(world.All().at(0).agents.empty()) << "nobody else is in its group at the end";
}

TEST(ReportAnchors, PixelsCountWhereTheTruePlaceIsInTheImage) {
  World world;
  const Eigen::Vector3d behind{2, 0.3, -5};
  world.Place(1, kPlaced_s, behind);
  world.Show(2, 1, kShown_s, kEnd_s, None, behind);
  EXPECT_FALSE(world.AtSecond().error_px) << "never in view";
  EXPECT_FALSE(world.AtSecond().view);
  World wrong;
  wrong.Place(1, kPlaced_s, kSeenPlace);
  wrong.Show(2, 1, kShown_s, kEnd_s, None, behind);
  EXPECT_DOUBLE_EQ(*wrong.AtSecond().error_px, 800) << "the image's diagonal";
}

TEST(ReportAnchors, TheViewIsWhereItIsFurthestInside) {
  World world;
  world.Place(1, kPlaced_s, kSeenPlace);
  world.Show(2, 1, kShown_s, kEnd_s, None);
  const AnchorMetrics kettle = world.All().at(0);
  ASSERT_TRUE(kettle.placing && kettle.agents[0].view);
  EXPECT_EQ(kettle.placing->agent, 1);
  EXPECT_EQ(kettle.placing->utime, Sensor(kPlaced_s));
  EXPECT_LT((kettle.placing->T_cam_anchor.t - Walk(1, kPlaced_s).Inverse() * kSeenPlace).norm(),
            2e-4);
  const AnchorView& view = *kettle.agents[0].view;
  const double s = 1e-6 * static_cast<double>(view.utime - kSensor);
  EXPECT_GE(s, kFused_s + 10);
  EXPECT_LT((*view.p_truth - Walk(2, s).Inverse() * kSeenPlace).norm(), 2e-5);
  const CameraModel& camera = world.session.cameras.at(2);
  const auto from_border = [&](double at_s) {
    const Eigen::Vector2d pixel = *camera.Project(Walk(2, at_s).Inverse() * kSeenPlace);
    return std::min({pixel.x(), pixel.y(), 1279 - pixel.x(), 959 - pixel.y()});
  };
  for (double other = kFused_s + 10; other <= kEnd_s; other += 1) {
    EXPECT_GE(from_border(s) + 1e-2, from_border(other)) << other;
  }
}

TEST(ReportAnchors, WhatIsNotKnownHasAReason) {
  World hidden;
  hidden.Place(1, kPlaced_s, kSeenPlace);
  EXPECT_EQ(hidden.AtSecond().reason, "agent 2 has not shown it");
  EXPECT_FALSE(hidden.AtSecond().largest_jump_m);

  World early = hidden;
  early.Show(2, 1, kShown_s, 15, None);
  EXPECT_THAT(early.AtSecond().reason, HasSubstr("from 10 s after the fusion on"));
  EXPECT_LT(*early.AtSecond().error_at_fusion_m, 2e-5);

  World shown = hidden;
  shown.Show(2, 1, kShown_s, kEnd_s, None);
  World untrue = shown;
  untrue.ground_truth[1].clear();
  EXPECT_EQ(untrue.AtSecond().reason, "agent 1 has no ground truth");
  EXPECT_FALSE(untrue.AtSecond().error_m);
  EXPECT_TRUE(untrue.AtSecond().largest_jump_m);
  untrue = shown;
  untrue.ground_truth[2].clear();
  EXPECT_EQ(untrue.AtSecond().reason, "agent 2 has no ground truth");
  World deaf = shown;
  deaf.tracks[1].heard.clear();
  EXPECT_EQ(deaf.AtSecond().reason, "agent 1 has not heard where it is");
  World other = shown;
  other.recording_maps[1] = {{1, 99}};
  EXPECT_EQ(other.AtSecond().reason, "agent 1 placed it in a map of another recording");
  World blind = shown;
  blind.odometry[1].clear();
  EXPECT_EQ(blind.AtSecond().reason, "agent 1 has no pose at its placing");
}

TEST(ReportAnchors, WhatWasNeverPlacedIsListed) {
  World world;
  AnchorEdit request;
  request.anchor = kSeenKettle;
  request.agent_id = 1;
  request.name = "kettle";
  request.placement = AnchorEdit::Placement::kPixel;
  request.map = kMaps[1];
  request.utime = Sensor(kPlaced_s);
  world.tracks[1].requests[kSeenKettle] = request;
  const auto all = world.All({{1, "kettle"}, {2, "pot"}});
  ASSERT_EQ(all.size(), 2u);
  EXPECT_FALSE(all[0].placed);
  ASSERT_EQ(all[0].agents.size(), 1u);
  EXPECT_FALSE(all[0].agents[0].error_m);
  EXPECT_FALSE(all[1].id);
  EXPECT_EQ(all[1].name, "pot");
  EXPECT_EQ(all[1].made_by, 2);
  EXPECT_TRUE(all[1].agents.empty());
}

}  // namespace
}  // namespace pangea
