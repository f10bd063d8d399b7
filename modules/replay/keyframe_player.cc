#include "replay/keyframe_player.h"

#include <fmt/format.h>

#include <cmath>

#include "bus/retransmission/playback_pace.h"
#include "files/progress.h"

namespace pangea {

KeyframePlayer::KeyframePlayer(Bus& bus, const KeyframePlayerOptions& options,
                               std::vector<LoggedKeyframe> keyframes, int64_t now_utime)
    : options_(options),
      keyframes_(std::move(keyframes)),
      node_(bus, fmt::format("keyframes_{}", options.agent_id)),
      publisher_(node_, options.agent_id, keyframes_.size(), now_utime) {}

std::optional<int64_t> KeyframePlayer::next_us() const {
  if (next_ == keyframes_.size()) {
    return std::nullopt;
  }
  const int64_t elapsed_us = keyframes_[next_].utime - keyframes_.front().utime;
  const bool over =
      options_.duration_s && 1e-6 * static_cast<double>(elapsed_us) > *options_.duration_s;
  return over ? std::nullopt : std::optional(elapsed_us);
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
