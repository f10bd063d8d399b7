#pragma once

// Plays a recording into the odometry, paced by the recording's own stamps. At rate 1 or less it
// behaves like live sensors: if the odometry cannot keep up, images are dropped
// (VioProcess::kMaxLag_us). At a higher rate no image is dropped; the odometry falls behind
// instead. The status reports by how much (lag_ms, in the recording's time;
// realtime_factor_permille).

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
  double start_s = 0;                // from the recording's first image
  std::optional<double> duration_s;  // if empty, to the end of the recording
  double delay_s = 0;                // wall clock, waited before the first image
  // Recording seconds per second; 0 = as fast as possible, but no faster than the server keeps up
  // (playback_pace.h).
  double rate = 1;
  std::string tracks_csv;  // file with exact tracks, used instead of the tracker; may be empty
};

// Reads a csv file with one row per observation: stamp_ns, landmark_id, u, v (pixels). The result
// is keyed by the image's stamp (utime). Throws std::runtime_error naming the file if it yields no
// row.
std::map<int64_t, TrackedFrame> ReadTracks(const std::string& csv, const CameraModel& camera);

class Playback {
 public:
  // `bus` may be null if there is nothing to listen to.
  Playback(LcmBus* bus, VioProcess& process, const EurocRecording& recording,
           const PlaybackOptions& options);

  // Plays to the end of the recording or until a signal, then waits until every keyframe is
  // acknowledged or no acknowledgement can be expected.
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
