#include "loop_verification/tags/tag_alignment.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <random>

#include "core/testing/numeric_jacobian.h"
#include "core/testing/test_random.h"
#include "loop_verification/aligner_test_world.h"
#include "loop_verification/tags/planar_pose.h"

namespace pangea {
namespace {

using Random = std::mt19937_64;

struct WallTag {
  int id = 1;
  Rigid3 T_room_tag;
  double size_m = 0.16;
};

// On the wall at x = 7, or hanging in the room nearer to the agents.
WallTag TagAt(int id, const Eigen::Vector3d& p_room, double size_m = 0.16) {
  Eigen::Matrix3d R;  // seen by somebody who looks along x: right is -y, down is -z
  R << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  return {id, {Eigen::Quaterniond(R), p_room}, size_m};
}

void Show(const std::vector<WallTag>& tags, double sigma_px, uint64_t seed, TestAgent* agent) {
  Random random(seed);
  std::normal_distribution<double> noise(0, sigma_px);
  for (size_t k = 0; k < agent->keyframes.size(); ++k) {
    Keyframe& keyframe = agent->keyframes[k];
    const Rigid3 T_room_cam = agent->T_room_body[k] * keyframe.camera.T_body_cam;
    for (const WallTag& tag : tags) {
      TagObservation seen{{TagFamily::k36h11, tag.id}, {}};
      bool visible = (T_room_cam.Inverse() * tag.T_room_tag).q.toRotationMatrix()(2, 2) > 0.2;
      for (int i = 0; i < kTagCorners && visible; ++i) {
        const auto& [x, y] = kTagCornerSigns[i];
        const Eigen::Vector3d p = tag.T_room_tag * (0.5 * tag.size_m * Eigen::Vector3d(x, y, 0));
        const auto pixel = keyframe.camera.Project(T_room_cam.Inverse() * p);
        visible = pixel && keyframe.camera.Contains(*pixel, 2);
        if (visible) {
          seen.corners[i] = (*pixel + Eigen::Vector2d(noise(random), noise(random))).cast<float>();
        }
      }
      if (visible) {
        keyframe.tags.push_back(seen);
      }
    }
  }
}

// Two agents that walk towards +y at x near 2 and look at +x.
TestAgent Walker(int run, int agent) {
  TestAgentOptions options;
  options.map = {agent, 1000 + run};
  options.num_keyframes = 10;
  options.start_angle = agent == 1 ? -0.45 : -0.3;
  options.radius = agent == 1 ? 2.0 : 2.4;
  options.height = agent == 1 ? 1.6 : 1.5;
  options.look_outward = 1.4;
  return RunTestAgent({}, options);
}

KeyframeWindow WindowOf(const TestAgent& agent, int newest = 9) {
  KeyframeStore store;
  for (const Keyframe& keyframe : agent.keyframes) {
    store.Add(keyframe);
  }
  return store.WindowUpTo(agent.keyframes[newest].id, 10);
}

Rigid3 TrueRelative(const TestAgent& m, const TestAgent& c) {
  return m.T_room_body.back().Inverse() * c.T_room_body.back();
}

double Nees(const TagAlignment& aligned, const Rigid3& truth) {
  const Vector6d error = aligned.T_Km_Kc.Minus(truth);
  return error.dot(aligned.covariance.ldlt().solve(error)) / 6;
}

const TagSizes kSizes({{"36h11", "0-20", 0.16}});

TEST(PosesOfSquare, OneIsTheTrueOne) {
  Random random(1);
  for (int run = 0; run < 200; ++run) {
    const Eigen::Vector3d tilt(Uniform(random, -0.9, 0.9), Uniform(random, -0.9, 0.9),
                               Uniform(random, -3, 3));
    const Rigid3 truth(ExpSo3(tilt), {Uniform(random, -2, 2), Uniform(random, -2, 2), 8});
    std::array<Eigen::Vector2d, kTagCorners> rays;
    for (int i = 0; i < kTagCorners; ++i) {
      rays[i] =
          (truth * Eigen::Vector3d(kTagCornerSigns[i][0], kTagCornerSigns[i][1], 0)).hnormalized();
    }
    const auto poses = PosesOfSquare(rays);
    ASSERT_EQ(poses.size(), 2u);
    EXPECT_LT(poses[0].Minus(truth).norm(), 1e-6);
    // The other one shows nearly the same.
    for (int i = 0; i < kTagCorners; ++i) {
      const Eigen::Vector2d ray =
          (poses[1] * Eigen::Vector3d(kTagCornerSigns[i][0], kTagCornerSigns[i][1], 0))
              .hnormalized();
      EXPECT_LT((ray - rays[i]).norm(), 0.06);
    }
  }
}

TEST(TagProblem, Jacobian) {
  TestAgent m = Walker(0, 1), c = Walker(0, 2);
  for (TestAgent* agent : {&m, &c}) {
    Show({TagAt(1, {4.5, 0.2, 1.7}), TagAt(2, {5, -0.9, 1.4})}, 0, 1, agent);
  }
  std::vector<TagView> views;
  for (int window = 0; window < 2; ++window) {
    const TestAgent& agent = window == 0 ? m : c;
    for (int frame = 0; frame < 10; ++frame) {
      for (const TagObservation& seen : agent.keyframes[frame].tags) {
        TagView view{window, frame, seen.tag.id - 1, {}};
        std::ranges::transform(seen.corners, view.pixels.begin(),
                               [](const Eigen::Vector2f& p) { return p.cast<double>().eval(); });
        views.push_back(view);
      }
    }
  }
  ASSERT_GT(views.size(), 20u);
  const TagProblem problem({MakeTagWindow(WindowOf(m)), MakeTagWindow(WindowOf(c))}, views,
                           {{-1.8, 0.01}, {-2, 1}});
  const Rigid3 T_w_room =
      Rigid3(m.keyframes[9].T_odom_body.q, Eigen::Vector3d::Zero()) * m.T_room_body[9].Inverse();
  TagEstimate at;
  at.T_m_c = T_w_room * c.T_room_body[9] *
             Rigid3(c.keyframes[9].T_odom_body.q, Eigen::Vector3d::Zero()).Inverse();
  at.T_m_tag = {T_w_room * TagAt(1, {4.5, 0.2, 1.7}).T_room_tag,
                T_w_room * TagAt(2, {5, -0.9, 1.4}).T_room_tag};
  at.log_size = {-1.75, -1.9};
  at.log_scale = {0.03, -0.05};
  at.T_m_c = at.T_m_c.Plus(Vector6d{0.02, 0.03, -0.01, 0.02, -0.03, 0.04});
  Eigen::MatrixXd J;
  ASSERT_TRUE(problem.Residuals(at, &J));
  const Eigen::MatrixXd numeric =
      NumericJacobian(problem.num_columns(), 1e-6, [&](const Eigen::VectorXd& step) {
        return *problem.Residuals(problem.Moved(at, step), nullptr);
      });
  EXPECT_LT((J - numeric).cwiseAbs().maxCoeff(), 1e-4 * J.cwiseAbs().maxCoeff());
}

struct Runs {
  int aligned = 0;
  double mean_nees = 0;
  double mean_error_m = 0;
};

Runs MonteCarlo(const TagSizes& sizes, const std::vector<WallTag>& tags) {
  Runs runs;
  for (int run = 0; run < 60; ++run) {
    TestAgent m = Walker(run, 1), c = Walker(run, 2);
    Show(tags, 0.4, 2 * run, &m);
    Show(tags, 0.4, 2 * run + 1, &c);
    const auto aligned = AlignByTags(WindowOf(m), WindowOf(c), sizes);
    if (aligned && aligned->chi2_to_rival.value_or(100) > 12) {
      const Rigid3 truth = TrueRelative(m, c);
      ++runs.aligned;
      runs.mean_nees += Nees(*aligned, truth);
      runs.mean_error_m += (aligned->T_Km_Kc.t - truth.t).norm();
    }
  }
  runs.mean_nees /= runs.aligned;
  runs.mean_error_m /= runs.aligned;
  return runs;
}

TEST(TagAlignment, IsAsAccurateAsItSaysWithAGivenSize) {
  const Runs runs = MonteCarlo(kSizes, {TagAt(7, {4.5, 0.2, 1.7})});
  EXPECT_GE(runs.aligned, 55);
  EXPECT_GT(runs.mean_nees, 0.5);
  EXPECT_LT(runs.mean_nees, 2);
  EXPECT_LT(runs.mean_error_m, 0.08);
}

TEST(TagAlignment, IsAsAccurateAsItSaysWithAnUnknownSize) {
  const Runs runs = MonteCarlo({}, {TagAt(7, {4.5, 0.2, 1.7})});
  EXPECT_GE(runs.aligned, 55);
  EXPECT_GT(runs.mean_nees, 0.5);
  EXPECT_LT(runs.mean_nees, 2);
  EXPECT_LT(runs.mean_error_m, 0.08);
}

TEST(TagAlignment, TwoTagsOfUnknownSizes) {
  const Runs runs = MonteCarlo({}, {TagAt(7, {4.5, 0.2, 1.7}), TagAt(9, {5.2, -0.6, 1.3}, 0.25)});
  EXPECT_GE(runs.aligned, 55);
  EXPECT_GT(runs.mean_nees, 0.5);
  EXPECT_LT(runs.mean_nees, 2);
  EXPECT_LT(runs.mean_error_m, 0.04);
}

PlaceCandidate ByTag(const TestAgent& match_agent) {
  return {match_agent.keyframes.back().id, PlaceKind::kTag, 1, {}};
}

Constraint AlignTagged(const TestAgent& m, const TestAgent& c,
                       const LoopVerificationOptions& options = {},
                       LoopVerificationReport* report = nullptr) {
  return Align(c, 9, m, 9, ByTag(m), options, report);
}

TEST(AlignerByTags, AcceptsWithoutAnyLandmark) {
  TestAgent m = Walker(3, 1), c = Walker(3, 2);
  for (TestAgent* agent : {&m, &c}) {
    Show({TagAt(7, {4.2, 0.2, 1.7})}, 0.3, 5, agent);
  }
  LoopVerificationOptions options;
  options.tags = {{"36h11", "7", 0.16}};
  const Constraint constraint = AlignTagged(m, c, options);
  EXPECT_TRUE(constraint.accepted) << constraint.reason;
  EXPECT_EQ(constraint.kind, PlaceKind::kTag);
  EXPECT_EQ(constraint.inlier_ratio, 1);
  EXPECT_LT((constraint.T_from_to.t - TrueRelative(m, c).t).norm(), 0.1);
}

// Where the keyframe looks, facing it.
WallTag Ahead(int id, const TestAgent& agent, int keyframe, double up_m = 0) {
  const Rigid3 T_room_cam =
      agent.T_room_body[keyframe] * agent.keyframes[keyframe].camera.T_body_cam;
  return {id, T_room_cam * Rigid3(Eigen::Quaterniond::Identity(), {0, -up_m, 2.5}), 0.16};
}

// The images agree: only the tags say that these are two rooms.
TEST(Aligner, RefusesDifferentTagsAtOnePlace) {
  const auto room = MakeTestRoom({.seed = 5});
  const TestAgent m = RunTestAgent(room, FirstAgent(0)), c = RunTestAgent(room, SecondAgent(0));
  const PlaceCandidate candidate = MakeTestCandidate(c, 9, m, 10, 40, 10);
  LoopVerificationOptions options;
  options.tags = {{"36h11", "0-20", 0.16}};
  ASSERT_TRUE(Align(c, 9, m, 10, candidate, options).accepted);
  const auto with_tags = [&](const WallTag& tag_m, const WallTag& tag_c) {
    TestAgent tagged_m = m, tagged_c = c;
    Show({tag_m}, 0.3, 1, &tagged_m);
    Show({tag_c}, 0.3, 2, &tagged_c);
    EXPECT_FALSE(tagged_m.keyframes[10].tags.empty());
    EXPECT_FALSE(tagged_c.keyframes[9].tags.empty());
    return Align(tagged_c, 9, tagged_m, 10, candidate, options).reason;
  };
  EXPECT_EQ(with_tags(Ahead(5, m, 10), Ahead(9, m, 10)), "different tags at one place");
  EXPECT_EQ(with_tags(Ahead(5, m, 10), Ahead(5, m, 10)), "");
  EXPECT_EQ(with_tags(Ahead(5, m, 10), Ahead(9, m, 10, 0.6)), "");
}

TEST(AlignerByTags, RefusesWithAReason) {
  TestAgent m = Walker(3, 1), c = Walker(3, 2);
  EXPECT_EQ(AlignTagged(m, c).reason, "no alignment by a common tag");
  // Of an unknown size, and so far away that no parallax shows it.
  TestAgent far_m = m, far_c = c;
  Show({TagAt(7, {30, 0, 1.7}, 1)}, 0.3, 5, &far_m);
  Show({TagAt(7, {30, 0, 1.7}, 1)}, 0.3, 6, &far_c);
  const Constraint far = AlignTagged(far_m, far_c);
  EXPECT_FALSE(far.accepted);
  // The tag was moved while one agent walked.
  Show({TagAt(7, {4.5, 0.2, 1.7})}, 0.3, 5, &m);
  Show({TagAt(7, {4.5, 0.2, 1.7})}, 0.3, 6, &c);
  for (int k = 5; k < 10; ++k) {
    for (TagObservation& seen : c.keyframes[k].tags) {
      for (Eigen::Vector2f& corner : seen.corners) {
        corner.x() += 60;
      }
    }
  }
  EXPECT_EQ(AlignTagged(m, c).reason, "corners of the tag do not fit");
}

}  // namespace
}  // namespace pangea
