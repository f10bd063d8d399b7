#pragma once

// Plays a recording into the odometry, paced by the recording's own stamps. In real time (rate 1 or
// less) it is as live sensors are: an odometry that cannot keep up drops images
// (VioProcess::kMaxLag_us). Faster, none is dropped: it falls behind. Its status says how far
// (lag_ms, in the recording's time; realtime_factor_permille).

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "bus/retransmission/playback_pace.h"
#include "files/progress.h"
#include "recording/euroc.h"
#include "vio/front_end/tracks.h"
#include "vio/vio_process.h"

namespace pangea::vio {

struct PlaybackOptions {
  double start_s = 0;                // after the recording's first image
  std::optional<double> duration_s;  // to the end without it
  double delay_s = 0;                // wall clock, before the first image
  // Recording seconds per second; 0 = as fast as possible, but no faster than the server keeps up
  // (playback_pace.h).
  double rate = 1;
  std::string tracks_csv;  // exact tracks instead of the tracker's; empty for none
};

// One csv row a feature: stamp_ns, landmark_id, u, v. By the image's stamp.
// Throws std::runtime_error naming the file when nothing can be read from it.
std::map<int64_t, TrackedFrame> ReadTracks(const std::string& csv, const CameraModel& camera);

class Playback {
 public:
  // `bus` may be null: nothing to listen to.
  Playback(LcmBus* bus, VioProcess& process, const EurocRecording& recording,
           const PlaybackOptions& options);

  // To the end of the recording or to a signal, then until every keyframe is acknowledged or nobody
  // will.
  void Run();

 private:
  bool WaitUntilDue(int64_t played_us, int64_t begin_wall);
  void PlayImage(size_t index);
  std::span<const ImuSample> ImuUntil(int64_t utime);

  VioProcess& process_;
  PlaybackPace pace_;
  const EurocRecording& recording_;
  PlaybackOptions options_;
  std::map<int64_t, TrackedFrame> tracks_;
  Progress progress_{"pangea-vio"};
  size_t next_imu_ = 0;
};

}  // namespace pangea::vio
