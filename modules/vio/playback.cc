#include "vio/playback.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <iostream>
#include <sstream>
#include <stdexcept>

#include "files/csv.h"
#include "files/text_file.h"

namespace pangea::vio {
namespace {

constexpr int64_t kImuBeforeStart_us = 500'000;
constexpr double kRealTime = 1;  // of PlaybackOptions::rate

int64_t ToUs(double seconds) { return static_cast<int64_t>(1e6 * seconds); }

}  // namespace

std::map<int64_t, TrackedFrame> ReadTracks(const std::string& csv, const CameraModel& camera) {
  std::ifstream file = OpenFile(csv);
  std::map<int64_t, TrackedFrame> frames;
  std::string line;
  while (std::getline(file, line)) {
    std::array<std::string, 4> field;
    std::istringstream fields(line);
    for (std::string& one : field) {
      std::getline(fields, one, ',');
    }
    int64_t stamp_ns = 0, landmark_id = 0;
    double u = 0, v = 0;
    if (!ParseNumber(field[0], &stamp_ns) || !ParseNumber(field[1], &landmark_id) ||
        !ParseNumber(field[2], &u) || !ParseNumber(field[3], &v)) {
      continue;  // the header
    }
    const auto ray = camera.Unproject({u, v});
    if (ray) {
      TrackedFrame& frame = frames[UtimeFromNs(stamp_ns)];
      frame.utime = UtimeFromNs(stamp_ns);
      Observation observation;
      observation.landmark_id = static_cast<int32_t>(landmark_id);
      observation.pixel = Eigen::Vector2d(u, v).cast<float>();
      observation.ray = *ray;
      frame.observations.push_back(observation);
    }
  }
  if (frames.empty()) {
    throw std::runtime_error(
        fmt::format("{}: no rows of 'stamp_ns, landmark_id, u, v' in it", csv));
  }
  return frames;
}

Playback::Playback(LcmBus* bus, VioProcess& process, const EurocRecording& recording,
                   const PlaybackOptions& options)
    : process_(process),
      pace_(bus, process, process.publisher()),
      recording_(recording),
      options_(options) {
  if (!options_.tracks_csv.empty()) {
    tracks_ = ReadTracks(options_.tracks_csv, recording.camera());
  }
}

void Playback::Run() {
  const std::vector<EurocImage>& images = recording_.images();
  const int64_t first = images.front().utime + ToUs(options_.start_s);
  const int64_t last =
      options_.duration_s ? first + ToUs(*options_.duration_s) : images.back().utime;
  size_t index = 0;
  while (index < images.size() && images[index].utime < first) {
    ++index;
  }
  if (index == images.size() || images[index].utime > last) {
    throw std::runtime_error(fmt::format(
        "{}: no image between {} s and the end asked for; it is {:.1f} s long", recording_.mav0(),
        options_.start_s, 1e-6 * static_cast<double>(images.back().utime - images.front().utime)));
  }
  const int64_t imu_begin =
      images[index].utime + ToUs(recording_.camera().time_offset_s) - kImuBeforeStart_us;
  while (next_imu_ < recording_.imu().size() && recording_.imu()[next_imu_].utime < imu_begin) {
    ++next_imu_;
  }
  pace_.WaitUntil(WallUtime() + ToUs(options_.delay_s));
  const int64_t begin_wall = WallUtime();
  const int64_t begin = images[index].utime;
  const auto num_images = std::ranges::upper_bound(images, last, {}, &EurocImage::utime) -
                          images.begin() - static_cast<int64_t>(index);
  int64_t num_played = 0;
  for (; num_played < num_images && !StopRequested(); ++index, ++num_played) {
    progress_.Update(num_played, num_images, "images");
    const int64_t played = images[index].utime - begin;
    if (!WaitUntilDue(played, begin_wall)) {
      continue;
    }
    PlayImage(index);
    const int64_t spent = std::max<int64_t>(1, WallUtime() - begin_wall);
    process_.node().Set("realtime_factor_permille", 1000 * played / spent);
    pace_.Serve(0);
  }
  process_.Flush();
  pace_.WaitAtTheEnd();
  process_.PublishFinished(WallUtime());
}

// Returns whether to play the image: in real time, an image that is too late is dropped.
bool Playback::WaitUntilDue(int64_t played_us, int64_t begin_wall) {
  if (options_.rate <= 0) {
    pace_.WaitForAcknowledgements();
    return true;
  }
  const auto due =
      begin_wall + static_cast<int64_t>(static_cast<double>(played_us) / options_.rate);
  pace_.WaitUntil(due);
  const auto lag_us = static_cast<int64_t>(options_.rate * static_cast<double>(WallUtime() - due));
  const bool drop = options_.rate <= kRealTime && lag_us > VioProcess::kMaxLag_us;
  process_.NoteLag(lag_us, drop ? 1 : 0);
  return !drop;
}

// The samples not yet given to the odometry, up to and including the first one at or after `utime`.
std::span<const ImuSample> Playback::ImuUntil(int64_t utime) {
  const std::vector<ImuSample>& imu = recording_.imu();
  const size_t begin = next_imu_;
  while (next_imu_ < imu.size() && (next_imu_ == begin || imu[next_imu_ - 1].utime < utime)) {
    ++next_imu_;
  }
  // The sample at or after the previous image may also be the one at or after this image.
  if (begin > 0 && begin < imu.size() && imu[begin - 1].utime >= utime) {
    next_imu_ = begin;
  }
  return {imu.data() + begin, next_imu_ - begin};
}

void Playback::PlayImage(size_t index) {
  const EurocImage& entry = recording_.images()[index];
  std::string why;
  const cv::Mat image = recording_.LoadImage(index, &why);
  if (image.empty()) {
    process_.node().Count("images_unreadable");
    std::cerr << fmt::format("pangea-vio: {}\n", why);
    return;
  }
  const std::span<const ImuSample> imu = ImuUntil(process_.ImuTimeOf(entry.utime));
  if (options_.tracks_csv.empty()) {
    process_.AddImage(entry.utime, image, imu);
    return;
  }
  const auto tracks = tracks_.find(entry.utime);
  process_.AddTracks(tracks == tracks_.end() ? TrackedFrame{entry.utime, {}} : tracks->second,
                     image, imu);
}

}  // namespace pangea::vio
