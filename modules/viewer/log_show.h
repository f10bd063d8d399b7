#pragma once

// A captured log, to be played, stopped and looked at at any time. Read once, at the start; what is
// drawn of it stays in memory. Going back builds the scene again from the beginning.

#include <memory>
#include <string>
#include <vector>

#include "log_file/log_reading.h"
#include "viewer/scene/scene_events.h"
#include "viewer/show.h"

namespace pangea::viewer {

class LogShow : public Show {
 public:
  // Poses in solved states that are kept; of more, every second solve that changes no group and is
  // not its group's last is left out until they fit (a pose is about 100 bytes).
  static constexpr size_t kMaxSolvedPoses = 4'000'000;

  // Of a damaged log what can be read. Throws std::runtime_error naming the log when it cannot be
  // opened, is none, or shows nothing.
  explicit LogShow(const std::string& path, size_t max_solved_poses = kMaxSolvedPoses);

  // The player's clock goes on by this much, if it plays.
  void Advance(double wall_s);

  const Scene& scene() const override { return *scene_; }
  int64_t epoch() const override { return epoch_; }
  ShowClock clock() const override { return clock_; }
  std::string source() const override { return source_; }
  std::vector<Fusion> all_fusions() const override { return all_fusions_; }
  void Seek(double time_s) override;
  void Play(bool play) override;
  void SetSpeed(double speed) override { clock_.speed = speed; }

  // Messages that were refused while reading.
  int64_t num_refused() const { return num_refused_; }
  // What of the log is lost.
  const LogReadings& readings() const { return readings_; }
  // In memory.
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
  size_t next_ = 0;  // into events_
};

}  // namespace pangea::viewer
