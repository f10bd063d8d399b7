#include "viewer/viewer_process.h"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>
#include <utility>

#include "common/channels.h"
#include "common/messages.h"

namespace pangea::viewer {
namespace {

constexpr int64_t kSecond = 1'000'000;
constexpr std::string_view kAllImages = "IMAGE_[0-9]+";
constexpr int32_t kMaxVerdictsAsked = 500;  // keyframes' verdicts
// What is beyond would not be shown anyway.
constexpr auto kMaxSeqAsked = static_cast<int32_t>(Scene::kMaxKeyframes);

}  // namespace

ViewerProcess::ViewerProcess(Bus& bus, std::string source, int64_t start_utime)
    : node_(bus, "viewer"), source_(std::move(source)), start_utime_(start_utime) {
  for (const std::string_view channel :
       {channels::kAllKeyframes, channels::kAllPoses, channels::kAllCorrections,
        channels::kConstraint, channels::kMapState, channels::kAllStatus, kAllImages,
        std::string_view("AGAIN_viewer")}) {
    node_.SubscribeBytes(std::string(channel),
                         [this](const std::string& name, Bytes data) { OnMessage(name, data); });
  }
  node_.Subscribe<have_t>(std::string(channels::kHave),
                          [this](const std::string&, const have_t& message) { OnHave(message); });
}

void ViewerProcess::WatchAgent(Bus& agent_bus) {
  agent_bus.Subscribe(std::string(kAllImages),
                      [this](const std::string& name, Bytes data) { OnMessage(name, data); });
}

void ViewerProcess::OnMessage(const std::string& channel, Bytes data) {
  SceneEvents::Outcome outcome = events_.Parse(channel, data);
  if (!outcome.refused.empty()) {
    node_.Refuse(outcome.refused);
  }
  if (!outcome.event) {
    return;
  }
  if (const auto* keyframe = std::get_if<ShownKeyframe>(&*outcome.event)) {
    keyframes_.Note(keyframe->id.map, keyframe->id.seq);
  }
  std::visit([this](const auto& event) { scene_.Take(event); }, *outcome.event);
}

void ViewerProcess::OnHave(const have_t& message) {
  for (size_t i = 0; i < message.maps.size(); ++i) {
    const Parsed<MapId> map = Parse(message.maps[i]);
    if (!map.value || message.highest_seq[i] < 0) {
      node_.Refuse("have: invalid map or seq");
      continue;
    }
    const int32_t highest_seq = std::min(message.highest_seq[i], kMaxSeqAsked);
    keyframes_.Announce(*map.value, highest_seq);
    if (verdicts_asked_.size() < Scene::kMaxMaps && verdicts_asked_.insert(*map.value).second) {
      for (int32_t seq = 0; seq <= highest_seq; seq += kMaxVerdictsAsked) {
        AskAgain(node_, std::string(channels::kConstraint),
                 {*map.value, seq, seq + kMaxVerdictsAsked - 1});
      }
    }
  }
  for (const seq_gap_t& gap : message.gaps) {
    const Parsed<MapId> map = Parse(gap.map);
    if (map.value && gap.from_seq >= 0 && gap.to_seq >= gap.from_seq) {
      keyframes_.Skip({*map.value, gap.from_seq, gap.to_seq});
    } else {
      node_.Refuse("have: invalid gap");
    }
  }
}

void ViewerProcess::AskForMissing(int64_t now_utime) {
  for (const SeqGap& gap : keyframes_.Due(now_utime)) {
    AskAgain(node_, channels::Keyframe(gap.map.agent_id), gap);
  }
}

void ViewerProcess::Tick(int64_t now_utime) {
  clock_.now_s = 1e-6 * static_cast<double>(now_utime - start_utime_);
  scene_.SetTime(clock_.now_s);
  AskForMissing(now_utime);
  if (now_utime >= next_status_utime_) {
    next_status_utime_ = now_utime + kSecond;
    node_.Set("keyframes", static_cast<int64_t>(scene_.keyframes().size()));
    node_.Set("left_out", scene_.num_left_out());
    node_.PublishStatus(
        now_utime, 0,
        fmt::format("{} agents, {} keyframes, {} verdicts shown", scene_.agents().size(),
                    scene_.keyframes().size(), scene_.constraints().size()));
  }
}

}  // namespace pangea::viewer
