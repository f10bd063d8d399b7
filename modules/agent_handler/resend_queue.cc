#include "agent_handler/resend_queue.h"

#include <algorithm>

#include "common/channels.h"
#include "common/messages.h"

namespace pangea {
namespace {

bool IsProcessName(const std::string& name) {
  constexpr size_t kMaxName = 40;  // with AGAIN_ below LCM's 63 characters
  return !name.empty() && name.size() <= kMaxName &&
         std::all_of(name.begin(), name.end(), [](char c) {
           return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_';
         });
}

}  // namespace

std::string ResendQueue::Add(const resend_request_t& m, const JournalIndex& index) {
  const auto map = Parse(m.map);
  if (!IsProcessName(m.requester) || !map.value || m.from_seq < 0 || m.to_seq < m.from_seq) {
    return "resend request out of range";
  }
  Request request{m.requester, m.channel,  JournalChannel::kKeyframe,
                  *map.value,  m.from_seq, std::min(m.to_seq, index.Highest(*map.value))};
  if (m.channel == channels::kPlaceMatch) {
    request.channel = JournalChannel::kPlaceMatch;
  } else if (m.channel == channels::kConstraint) {
    request.channel = JournalChannel::kConstraint;
  } else if (m.channel != channels::Keyframe(map.value->agent_id)) {
    return "resend request for a channel that is not journalled";
  }
  const bool covered = std::any_of(requests_.begin(), requests_.end(), [&](const Request& r) {
    return r.requester == request.requester && r.channel == request.channel &&
           r.map == request.map && r.next_seq <= request.next_seq && request.to_seq <= r.to_seq;
  });
  if (covered || request.to_seq < request.next_seq) {
    return "";
  }
  if (requests_.size() >= kMaxRequests) {
    return "too many resend requests are waiting";
  }
  requests_.push_back(std::move(request));
  return "";
}

std::optional<ResendQueue::Answer> ResendQueue::Next(const JournalIndex& index) {
  if (requests_.empty()) {
    return std::nullopt;
  }
  Request& request = requests_.front();
  Answer answer{request.requester, request.channel_name,
                index.Find(request.channel, {request.map, request.next_seq})};
  if (++request.next_seq > request.to_seq) {
    requests_.pop_front();
  }
  return answer;
}

}  // namespace pangea
