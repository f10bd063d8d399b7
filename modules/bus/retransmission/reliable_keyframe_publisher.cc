#include "bus/retransmission/reliable_keyframe_publisher.h"

#include <algorithm>
#include <functional>

#include "messages/catch_up_messages.h"
#include "messages/channels.h"
#include "messages/messages.h"
#include "pangea/again_t.hpp"

namespace pangea {
ReliableKeyframePublisher::ReliableKeyframePublisher(Node& node, int32_t agent_id, size_t kept,
                                                     int64_t now_utime)
    : node_(node), agent_id_(agent_id), max_kept_(kept), uplink_seen_utime_(now_utime) {
  node_.Listen<have_t>(channels::kHave, std::bind_front(&ReliableKeyframePublisher::OnHave, this));
  node_.Listen<resend_request_t>(
      channels::kResendRequest, std::bind_front(&ReliableKeyframePublisher::OnResendRequest, this));
}

void ReliableKeyframePublisher::Publish(const KeyframeId& id, std::vector<uint8_t> bytes) {
  node_.bus().Publish(channels::Keyframe(agent_id_), bytes);
  node_.Count("keyframes");
  node_.Count("keyframe_bytes", static_cast<int64_t>(bytes.size()));
  published_[id.map] = id.seq + 1;
  kept_.push_back({id, std::move(bytes)});
  if (kept_.size() > max_kept_) {
    kept_.pop_front();
  }
}

void ReliableKeyframePublisher::Tick(int64_t now_utime) {
  if (uplink_seen_) {
    uplink_seen_utime_ = now_utime;
    uplink_seen_ = false;
  }
}

int64_t ReliableKeyframePublisher::Unacknowledged() const {
  int64_t count = 0;
  for (const auto& [map, published] : published_) {
    const auto it = acknowledged_.find(map);
    count += std::max(0, published - (it == acknowledged_.end() ? 0 : it->second));
  }
  return count;
}

void ReliableKeyframePublisher::OnHave(const Have& have) {
  uplink_seen_ = true;
  uplink_ever_seen_ = true;
  for (const auto& [map, highest_seq] : have.highest_seq) {
    if (map.agent_id == agent_id_) {
      int32_t& acknowledged = acknowledged_[map];
      acknowledged = std::max(acknowledged, highest_seq + 1);
    }
  }
}

void ReliableKeyframePublisher::OnResendRequest(const ResendRequest& request) {
  if (request.channel != channels::Keyframe(agent_id_)) {
    return;
  }
  const SeqGap& range = request.range;
  int answers = 0;
  for (const KeptKeyframe& keyframe : kept_) {
    if (keyframe.id.map != range.map || keyframe.id.seq < range.from_seq ||
        keyframe.id.seq > range.to_seq) {
      continue;
    }
    if (++answers > kMaxAnswers) {
      break;
    }
    Answer(request.requester, keyframe);
  }
  const auto published = published_.find(range.map);
  if (published != published_.end() && range.from_seq < published->second) {
    return;
  }
  const auto later = std::find_if(kept_.begin(), kept_.end(), [&](const KeptKeyframe& keyframe) {
    return range.map < keyframe.id.map;
  });
  if (later != kept_.end()) {
    Answer(request.requester, *later);
  }
}

void ReliableKeyframePublisher::Answer(const std::string& requester, const KeptKeyframe& keyframe) {
  again_t again{};
  again.channel = channels::Keyframe(agent_id_);
  again.data = keyframe.bytes;
  again.num_bytes = static_cast<int32_t>(again.data.size());
  node_.Publish(channels::Again(requester), again);
  node_.Count("resent");
}

}  // namespace pangea
