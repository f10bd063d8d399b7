#include "replay/keyframe_player.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iostream>

#include "bus/retransmission/playback_pace.h"
#include "files/progress.h"

namespace pangea {

namespace {

// When to play each keyframe, microseconds after the first one. Sensor clocks of two maps may
// differ in any way, so between them time may also go back.
std::vector<int64_t> TimesOf(const std::vector<LoggedKeyframe>& keyframes) {
  std::vector<int64_t> times_us;
  for (size_t i = 0; i < keyframes.size(); ++i) {
    times_us.push_back(i == 0 ? 0
                              : times_us.back() +
                                    std::clamp<int64_t>(keyframes[i].utime - keyframes[i - 1].utime,
                                                        0, KeyframePlayer::kLongestPause_us));
  }
  return times_us;
}

}  // namespace

KeyframePlayer::KeyframePlayer(Bus& bus, const KeyframePlayerOptions& options,
                               std::vector<LoggedKeyframe> keyframes, int64_t now_utime)
    : options_(options),
      keyframes_(std::move(keyframes)),
      times_us_(TimesOf(keyframes_)),
      node_(bus, fmt::format("keyframes_{}", options.agent_id)),
      publisher_(node_, options.agent_id, keyframes_.size(), now_utime) {}

std::optional<int64_t> KeyframePlayer::next_us() const {
  if (next_ == keyframes_.size()) {
    return std::nullopt;
  }
  const bool over =
      options_.duration_s && 1e-6 * static_cast<double>(times_us_[next_]) > *options_.duration_s;
  return over ? std::nullopt : std::optional(times_us_[next_]);
}

std::string KeyframePlayer::Plan() const {
  const auto seconds = [](int64_t us) { return 1e-6 * static_cast<double>(us); };
  int cut = 0;
  for (size_t i = 1; i < keyframes_.size(); ++i) {
    cut += keyframes_[i].utime - keyframes_[i - 1].utime > kLongestPause_us ? 1 : 0;
  }
  return fmt::format("agent {}: {} keyframes, {:.0f} s{}", options_.agent_id, keyframes_.size(),
                     seconds(times_us_.empty() ? 0 : times_us_.back()),
                     cut == 0 ? ""
                              : fmt::format("; {} longer pauses take {:g} s each", cut,
                                            seconds(kLongestPause_us)));
}

void KeyframePlayer::PlayNext() {
  const LoggedKeyframe& keyframe = keyframes_[next_++];
  publisher_.Publish(keyframe.id, keyframe.data);
}

void KeyframePlayer::Tick(int64_t now_utime) {
  publisher_.Tick(now_utime);
  if (node_.StatusIsDue(now_utime)) {
    node_.PublishStatus(now_utime, publisher_.Unacknowledged(),
                        fmt::format("agent {}: stored keyframe {} of {}", options_.agent_id, next_,
                                    keyframes_.size()));
  }
}

void KeyframePlayer::PublishFinished(int64_t now_utime) {
  node_.Set("finished", 1);
  node_.PublishStatus(now_utime, publisher_.Unacknowledged(), "finished");
}

void PlayKeyframes(LcmBus& bus, const KeyframePlayerOptions& options,
                   std::vector<LoggedKeyframe> keyframes) {
  const int64_t begin = WallUtime();
  Progress progress("pangea-keyframe-player");
  int64_t played = 0;
  const int64_t all = std::ssize(keyframes);
  KeyframePlayer player(bus, options, std::move(keyframes), begin);
  std::cerr << fmt::format("pangea-keyframe-player: {}\n", player.Plan());
  PlaybackPace pace(&bus, player, player.publisher());
  for (auto next = player.next_us(); next && !StopRequested(); next = player.next_us()) {
    if (options.rate > 0) {
      pace.WaitUntil(begin + std::llround(static_cast<double>(*next) / options.rate));
    } else {
      pace.WaitForAcknowledgements();
    }
    player.PlayNext();
    progress.Update(++played, all, "keyframes");
    pace.Serve(0);
  }
  pace.WaitAtTheEnd();
  player.PublishFinished(WallUtime());
}

}  // namespace pangea
