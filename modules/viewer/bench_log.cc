// Writes a synthetic log for measurements of the viewer. Agents walk in circles through one hall,
// with three keyframes and ten poses per second. From half of the time on they are one group, which
// is optimised twice per second; every optimisation moves all poses. The group has ten anchors.
//   pangea-viewer-bench-log OUT.lcm AGENTS KEYFRAMES_PER_AGENT POINTS_PER_KEYFRAME

#include <fmt/format.h>

#include <cmath>
#include <iostream>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "log_file/log_writer.h"
#include "messages/anchor_messages.h"
#include "messages/channels.h"
#include "messages/encoding.h"
#include "messages/messages.h"
#include "pangea/pose_t.hpp"
#include "pangea/status_t.hpp"

namespace {

using namespace pangea;

constexpr int64_t kStart = 1'700'000'000'000'000;
constexpr int64_t kSecond = 1'000'000;
constexpr int64_t kStep = kSecond / 30;  // keyframes every 10 steps, poses every 3

struct Plan {
  int agents = 12;
  int keyframes = 120;  // per agent
  int points = 70;      // per keyframe
};

class BenchLog {
 public:
  BenchLog(const std::string& path, const Plan& plan) : plan_(plan), file_(path) {}

  void Write() {
    for (int step = 0; step < 10 * plan_.keyframes; ++step) {
      now_ = kStart + step * kStep;
      for (int agent = 1; agent <= plan_.agents; ++agent) {
        WriteAgent(agent, step);
      }
      if (step % 15 == 14 && step > 5 * plan_.keyframes) {
        WriteSolve(step / 10);
      }
      if (step % 30 == 0) {
        WriteStatuses();
      }
    }
  }

 private:
  static MapId MapOf(int agent) { return {agent, kStart}; }

  // Agents walk on circles of 3 m in a hall of 30 m.
  static Rigid3 PoseOf(int agent, double time_s) {
    const double angle = 0.4 * time_s + agent;
    const Eigen::Vector3d centre(6.0 * (agent % 4), 6.0 * std::floor(agent / 4.0), 1.5);
    const Eigen::Vector3d out(std::cos(angle), std::sin(angle), 0);
    // Here the camera axes are the body axes, and z looks outwards.
    Eigen::Matrix3d R;
    R.col(2) = out;
    R.col(1) = -Eigen::Vector3d::UnitZ();
    R.col(0) = R.col(1).cross(R.col(2));
    return {Eigen::Quaterniond(R), centre + 3.0 * out};
  }

  void WriteAgent(int agent, int step) {
    const double time_s = step / 30.0;
    if (step % 3 == 0) {
      pose_t pose{};
      pose.utime = now_;
      pose.state = pose_t::STATE_TRACKING;
      pose.map = ToMessage(MapOf(agent));
      pose.T_odom_body = ToMessage(PoseOf(agent, time_s));
      pose.T_map_body = pose.T_odom_body;
      pose.num_tracked = 150;
      Put(channels::Pose(agent), pose);
    }
    if (step % 10 == 0) {
      WriteKeyframe(agent, step / 10);
    }
  }

  void WriteKeyframe(int agent, int seq) {
    std::uniform_real_distribution<float> u(0, 751), v(0, 479), depth(2, 12);
    Keyframe keyframe;
    keyframe.id = {MapOf(agent), seq};
    keyframe.utime = now_;
    keyframe.camera.width = 752;
    keyframe.camera.height = 480;
    keyframe.camera.fx = keyframe.camera.fy = 460;
    keyframe.camera.cx = 376;
    keyframe.camera.cy = 240;
    keyframe.T_odom_body = PoseOf(agent, seq / 3.0);
    for (int i = 0; i < plan_.points; ++i) {
      Corner corner;
      corner.pixel = {u(random_), v(random_)};
      corner.landmark_id = plan_.points * seq + i;  // a new landmark: each is drawn once
      keyframe.corners.push_back(corner);
      const float inverse_depth = 1 / depth(random_);
      keyframe.points.push_back({i, inverse_depth, std::pow(0.05F * inverse_depth, 2.0F)});
    }
    Put(channels::Keyframe(agent), ToMessage(keyframe));
    if (agent > 1 && seq > plan_.keyframes / 2) {
      Constraint constraint;
      constraint.from = {MapOf(agent - 1), seq / 2};
      constraint.to = keyframe.id;
      constraint.accepted = seq % 3 != 0;
      constraint.reason = constraint.accepted ? "" : "the surroundings contradict";
      constraint.num_inliers = 60;
      constraint.inlier_ratio = 0.9;
      constraint.rms_px = 0.8;
      Put(std::string(channels::kConstraint), ToMessage(constraint));
    }
  }

  void WriteSolve(int highest_seq) {
    std::normal_distribution<double> noise(0, 0.002);
    MapState state;
    state.group = MapOf(1);
    state.revision = ++revision_;
    for (int agent = 1; agent <= plan_.agents; ++agent) {
      state.maps.push_back(MapOf(agent));
      for (int seq = 0; seq <= highest_seq; ++seq) {
        Rigid3 T = PoseOf(agent, seq / 3.0);
        T.t += Eigen::Vector3d(noise(random_), noise(random_), noise(random_));
        state.keyframes.push_back({{MapOf(agent), seq}, kStart + seq * kSecond / 3, T});
      }
      Correction correction;
      correction.map = MapOf(agent);
      correction.seq = highest_seq;
      correction.group = MapOf(1);
      correction.revision = revision_;
      correction.covariance = 1e-4 * Matrix6d::Identity();
      Put(channels::Correction(agent), ToMessage(correction));
    }
    for (const map_state_t& chunk : ToMessages(state)) {
      Put(std::string(channels::kMapState), chunk);
    }
    WriteAnchors();
  }

  // Puts the anchors in front of the first ten keyframes of agent 1.
  void WriteAnchors() {
    for (int n = 0; n < 10; ++n) {
      AnchorState anchor;
      anchor.anchor = {1, kStart + n};
      anchor.revision = 1;
      anchor.edited_by = 1;
      anchor.name = fmt::format("anchor {}", n);
      anchor.map = anchor.group = MapOf(1);
      anchor.group_revision = revision_;
      anchor.T_odom_anchor.t = PoseOf(1, n / 3.0) * Eigen::Vector3d(0, 0, 2);
      anchor.covariance = 1e-4 * Matrix6d::Identity();
      Put(std::string(channels::kAnchor), ToMessage(anchor));
    }
  }

  void WriteStatuses() {
    const auto put = [this](const std::string& process) {
      status_t status{};
      status.process = process;
      status.utime = now_;
      status.summary = "a line for people, about as long as they are";
      status.messages_in = now_ - kStart;
      status.handling_median_ms = 0.3F;
      status.handling_p99_ms = 21;
      Put(channels::Status(process), status);
    };
    for (const char* process : {"agent_handler", "place_recognition", "inter_map_ba", "fusion",
                                "posegraph", "global_ba"}) {
      put(process);
    }
  }

  template <typename Message>
  void Put(const std::string& channel, const Message& message) {
    file_.Write(now_, channel, EncodeMessage(message));
  }

  Plan plan_;
  LogFileWriter file_;
  std::mt19937 random_{1};
  int64_t now_ = 0;
  int64_t revision_ = 0;
};

}  // namespace

int main(int argc, char** argv) {
  if (argc != 5) {
    std::cerr << "usage: pangea-viewer-bench-log OUT.lcm AGENTS KEYFRAMES_PER_AGENT "
                 "POINTS_PER_KEYFRAME\n";
    return 2;
  }
  BenchLog(argv[1], {std::stoi(argv[2]), std::stoi(argv[3]), std::stoi(argv[4])}).Write();
  return 0;
}
