#include "agent_handler/journal/resend_queue.h"

#include <algorithm>
#include <utility>

#include "messages/catch_up_messages.h"
#include "messages/channels.h"

namespace pangea {

std::string ResendQueue::Add(const resend_request_t& message, const JournalIndex& index) {
  if (message.channel == channels::kMapState) {
    return "";  // the pose graph answers it
  }
  const auto parsed = Parse(message);
  if (!parsed.value) {
    return parsed.refused;
  }
  const auto& [map, from_seq, to_seq] = parsed.value->range;
  Request request{parsed.value->channel, JournalChannel::kKeyframe, map, from_seq,
                  std::min(to_seq, index.Highest(map))};
  if (request.channel_name == channels::kPlaceMatch) {
    request.channel = JournalChannel::kPlaceMatch;
  } else if (request.channel_name == channels::kConstraint) {
    request.channel = JournalChannel::kConstraint;
  } else if (request.channel_name != channels::Keyframe(map.agent_id)) {
    return "resend request for a channel that is not journalled";
  }
  if (request.to_seq < request.next_seq) {
    return "";
  }
  const std::string& requester = parsed.value->requester;
  if (!requests_.contains(requester) && requests_.size() >= kMaxRequesters) {
    return "resend requests of too many requesters are waiting";
  }
  std::deque<Request>& waiting = requests_[requester];
  const bool covered = std::ranges::any_of(waiting, [&](const Request& r) {
    return r.channel == request.channel && r.map == request.map && r.next_seq <= request.next_seq &&
           request.to_seq <= r.to_seq;
  });
  if (!covered && waiting.size() >= kMaxRequests) {
    return "too many resend requests are waiting";
  }
  if (!covered) {
    waiting.push_back(std::move(request));
  }
  return "";
}

size_t ResendQueue::waiting() const {
  size_t count = named_.size();
  for (const auto& [requester, requests] : requests_) {
    count += requests.size();
  }
  return count;
}

bool ResendQueue::Add(const VerificationRequest& request, const JournalIndex& index) {
  std::vector<JournalPlace> places = index.Find(request.names);
  if (!places.empty() && named_.size() >= kMaxNamed) {
    return false;
  }
  if (!places.empty()) {
    named_.push_back({request.requester, std::string(channels::kConstraint), std::move(places)});
  }
  return true;
}

std::optional<ResendQueue::Answer> ResendQueue::Next(const JournalIndex& index) {
  if (!named_.empty()) {
    Answer answer = std::move(named_.front());
    named_.pop_front();
    return answer;
  }
  if (requests_.empty()) {
    return std::nullopt;
  }
  auto next = requests_.upper_bound(answered_);
  next = next == requests_.end() ? requests_.begin() : next;
  answered_ = next->first;
  Request& request = next->second.front();
  Answer answer{next->first, request.channel_name,
                index.Find(request.channel, {request.map, request.next_seq})};
  if (++request.next_seq > request.to_seq) {
    next->second.pop_front();
    if (next->second.empty()) {
      requests_.erase(next);
    }
  }
  return answer;
}

}  // namespace pangea
