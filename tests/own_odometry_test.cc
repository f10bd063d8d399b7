// Tests an external odometry as an agent: examples/own_odometry with drifting ground-truth poses
// and an agent of pangea-vio become one map.

#include <gtest/gtest.h>

#include <fstream>
#include <random>

#include "programs.h"
#include "recording/euroc.h"
#include "recording/trajectory.h"

namespace pangea::tests {
namespace {

namespace fs = std::filesystem;

// Adds a random walk of position and yaw, in an odom frame of its own.
Trajectory Drifting(const Trajectory& truth) {
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal;
  constexpr double kStep_m = 6e-4, kStep_rad = 1e-4;  // each pose; 200 of them a second
  Trajectory drifting;
  Rigid3 T(YawRotation(1.3), {4, -2, 1});
  for (size_t i = 0; i < truth.size(); ++i) {
    const Rigid3 step = i == 0 ? truth[0].T : truth[i - 1].T.Inverse() * truth[i].T;  // exact
    T = T * step;
    T.t += kStep_m * Eigen::Vector3d(normal(random), normal(random), normal(random));
    T.q = YawRotation(kStep_rad * normal(random)) * T.q;
    drifting.push_back({truth[i].utime, T});
  }
  return drifting;
}

TEST(OwnOdometry, FusesWithAnAgentOfVio) {
  const fs::path folder = FreshFolder("own_odometry");
  const std::string walk_1 = Walk(1).string(), walk_2 = Walk(2).string();
  std::vector<std::string> warnings;
  WriteTum((folder / "poses.tum").string(), Drifting(ReadEurocGroundTruthOf(walk_2, &warnings)));
  std::ofstream(folder / "poses.tum", std::ios::app) << "a row that is none\n";
  const auto path = [&folder](const char* name) { return (folder / name).string(); };

  Outcome outcome = RunCommand("pangea-vio --agent 1 --bus none --rate max --recording " + walk_1 +
                               " --out-keyframes " + path("one.lcm"));
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  outcome = RunCommand("pangea-own-odometry-example --agent 2 --recording " + walk_2 + " --poses " +
                       path("poses.tum") + " --out-keyframes " + path("two.lcm"));
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  EXPECT_NE(outcome.output.find("row dropped"), std::string::npos) << outcome.output;
  outcome =
      RunCommand("pangea-session replay " + path("one.lcm") + " " + path("two.lcm") + " --out " +
                 path("out") + " --recording 1=" + walk_1 + " --recording 2=" + walk_2);
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;

  const auto report = ReadJson(folder / "out" / "report.json");
  ASSERT_EQ(report["groups"].size(), 1u) << outcome.output;
  EXPECT_EQ(report["groups"][0]["agents"], nlohmann::json({1, 2}));
  std::cout << "joint ATE " << report["ate_joint_m"] << " m\n";
  EXPECT_LT(report["ate_joint_m"].get<double>(), 0.1) << outcome.output;

  // Two seconds without poses: the odometry was lost.
  Trajectory holed = ReadTrajectory(path("poses.tum"), &warnings);
  const int64_t lost_utime = holed.front().utime + 6'000'000;
  std::erase_if(holed, [lost_utime](const StampedPose& pose) {
    return pose.utime > lost_utime && pose.utime < lost_utime + 2'000'000;
  });
  WriteTum(path("holed.tum"), holed);
  outcome = RunCommand("pangea-own-odometry-example --agent 2 --recording " + walk_2 + " --poses " +
                       path("holed.tum") + " --out-keyframes " + path("maps.lcm") +
                       " && pangea-log list " + path("maps.lcm") +
                       " --fields | grep -o 'opened_utime = [0-9]*' | sort -u | wc -l");
  EXPECT_NE(outcome.output.find("keyframes in 2 maps\n2\n"), std::string::npos) << outcome.output;

  // Quaternions with w first, and poses in millimetres.
  Trajectory w_first = ReadTrajectory(path("poses.tum"), &warnings), in_mm = w_first;
  for (StampedPose& pose : w_first) {
    pose.T.q = Eigen::Quaterniond(pose.T.q.z(), pose.T.q.w(), pose.T.q.x(), pose.T.q.y());
  }
  WriteTum(path("w_first.tum"), w_first);
  for (StampedPose& pose : in_mm) {
    pose.T.t *= 1000;
  }
  WriteTum(path("in_mm.tum"), in_mm);
  const std::string example =
      "pangea-own-odometry-example --agent 2 --recording " + walk_2 + " --poses ";
  outcome = RunCommand(example + path("w_first.tum"));
  EXPECT_NE(outcome.output.find("keyframes have no map points"), std::string::npos)
      << outcome.output;
  outcome = RunCommand(example + path("in_mm.tum"));
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_NE(outcome.output.find("they must be in metres"), std::string::npos) << outcome.output;

  outcome = RunCommand("pangea-own-odometry-example --agent 2 --recording " + walk_1 + " --poses " +
                       path("out/agent_1.tum") + " --out-keyframes " + path("no/such/folder.lcm"));
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_NE(outcome.output.find("folder.lcm: cannot be written"), std::string::npos)
      << outcome.output;
  fs::remove_all(folder);
}

}  // namespace
}  // namespace pangea::tests
