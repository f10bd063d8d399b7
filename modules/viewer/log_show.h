#pragma once

// Shows a captured log, which can be played, stopped and searched. The log is read once, at the
// start, and everything that is drawn stays in memory. To go back in time, the scene is built again
// from the beginning.

#include <memory>
#include <string>
#include <vector>

#include "log_file/log_reading.h"
#include "viewer/scene/scene_events.h"
#include "viewer/show.h"

namespace pangea::viewer {

class LogShow : public Show {
 public:
  // Bound for the optimised poses in memory (about 100 bytes each). While there are more, every
  // second optimisation is left out that changes no group and is not the last of its group.
  static constexpr size_t kMaxSolvedPoses = 4'000'000;

  // Of a damaged log, shows what can be read. Throws std::runtime_error with the log's name when it
  // cannot be opened, is not a log, or has nothing to show.
  explicit LogShow(const std::string& path, size_t max_solved_poses = kMaxSolvedPoses);

  // Advances the player's clock by `wall_s` seconds times the speed, if it plays.
  void Advance(double wall_s);

  const Scene& scene() const override { return *scene_; }
  int64_t epoch() const override { return epoch_; }
  ShowClock clock() const override { return clock_; }
  std::string source() const override { return source_; }
  std::vector<Fusion> all_fusions() const override { return all_fusions_; }
  void Seek(double time_s) override;
  void Play(bool play) override;
  void SetSpeed(double speed) override { clock_.speed = speed; }

  // Number of messages that were refused while reading.
  int64_t num_refused() const { return num_refused_; }
  // What could not be read of the log.
  const LogReadings& readings() const { return readings_; }
  // Numbers of poses and anchor states in memory.
  size_t NumSolvedPoses() const;
  size_t NumAnchorStates() const;

 private:
  struct Timed {
    double time_s = 0;
    SceneEvent event;
  };

  void Read(const std::string& path);
  void DropUnseenImages();
  void ThinStates(size_t max_poses);
  void Reset();
  void RunTo(double time_s);

  std::string source_;
  LogReadings readings_;
  std::vector<Timed> events_;
  std::vector<Fusion> all_fusions_;
  int64_t num_refused_ = 0;
  ShowClock clock_;
  int64_t epoch_ = 0;
  std::unique_ptr<Scene> scene_;
  size_t next_ = 0;  // index of the next event in events_
};

}  // namespace pangea::viewer
