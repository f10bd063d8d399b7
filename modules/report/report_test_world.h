#pragma once

// Test data for the report: two agents that walk for half a minute, their recordings with ground
// truth, and the logs of their buses and of the server's bus.

#include <gtest/gtest.h>

#include <cstdint>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "core/keyframe.h"
#include "core/rigid3.h"
#include "core/server_messages.h"
#include "log_file/log_writer.h"
#include "messages/encoding.h"
#include "recording/trajectory.h"
#include "report/report.h"

namespace pangea {

constexpr int64_t kStart = 1'400'000'000'000'000;   // first image, microseconds
constexpr int64_t kOpened = 1'700'000'000'000'000;  // when the maps were opened

class LogWriter {
 public:
  explicit LogWriter(const std::string& path) : log_(path) {}

  template <typename Message>
  void Write(const std::string& channel, const Message& message) {
    WriteBytes(channel, EncodeMessage(message));
  }
  void WriteBytes(const std::string& channel, Bytes bytes);

 private:
  LogFileWriter log_;
  int64_t utime_ = kOpened;
};

// Body pose of the agent `s` seconds after its first image, in the ground truth's frame.
Rigid3 Truth(int32_t agent, double s);
Rigid3 OdomFromTruth(int32_t agent);
// The odometry's pose; its scale is wrong by 2 %.
Rigid3 Odometry(int32_t agent, double s);
int64_t Utime(double s);

class ReportWorld : public ::testing::Test {
 protected:
  static constexpr double kDuration = 30;       // seconds of recording
  static constexpr double kInit = 2;            // first pose
  static constexpr double kCorrected = 12.025;  // the shown pose is exact from here on
  static constexpr double kKeyframePeriod = 0.5;

  void SetUp() override;

  std::string Recording(int32_t agent) const;
  std::string AgentLog(int32_t agent) const;
  static MapId Map(int32_t agent, int nth = 0) {
    return {agent, kOpened + agent * int64_t{1000} + nth};
  }
  static std::string Underscored(const MapId& map);
  static int NumKeyframes() { return static_cast<int>((kDuration - kInit) / kKeyframePeriod) + 1; }
  static double Seconds(int seq) { return kInit + kKeyframePeriod * seq; }

  // `walk`: the agent that walked so; 0: the map's own.
  void LogKeyframes(const MapId& map, int begin, int end, int32_t walk = 0);
  void LogBoth();
  // True poses in the odom frame of the first map's agent, except for a shift of agent 2's.
  static MapState State(int64_t revision, const std::vector<MapId>& maps, int num_keyframes,
                        const Eigen::Vector3d& shift_of_second = Eigen::Vector3d::Zero());
  void LogState(const MapState& state);
  void LogConstraint(int seq, bool accepted, const std::string& reason);

  // Writes the report; returns its report.json.
  nlohmann::json Report();
  std::string Text(const std::string& file) const;
  Trajectory Tum(const std::string& file) const;
  bool Exists(const std::string& file) const;

  std::string folder_;
  std::string markdown_;
  ReportInput input_;
  std::unique_ptr<LogWriter> log_;

 private:
  void WriteRecording(int32_t agent) const;
  void WriteAgentLog(int32_t agent) const;
  static Keyframe MakeKeyframe(const MapId& map, int seq, double s, int32_t walk);
};

}  // namespace pangea
