#include "bus/retransmission/missing.h"

#include <algorithm>

#include "bus/retransmission/timeouts.h"
#include "messages/messages.h"
#include "pangea/resend_request_t.hpp"

namespace pangea {
void RequestRetransmission(Node& node, const std::string& channel, const SeqGap& gap) {
  resend_request_t request{};
  request.requester = node.name();
  request.channel = channel;
  request.map = ToMessage(gap.map);
  request.from_seq = gap.from_seq;
  request.to_seq = gap.to_seq;
  node.Publish(std::string(channels::kResendRequest), request);
  node.NoteResendAsked();
}

void RequestAllRetransmissions(Node& node, const std::string& channel, const MapId& map,
                               int32_t highest_seq) {
  for (int32_t seq = 0; seq <= highest_seq; seq += timeouts::kMaxSmallAsked) {
    RequestRetransmission(node, channel,
                          {map, seq, std::min(seq + timeouts::kMaxSmallAsked - 1, highest_seq)});
  }
}

void RequestResults(Node& node, const ResultNames& names) {
  verdict_request_t request{};
  request.requester = node.name();
  request.map = ToMessage(names.map);
  for (const auto& [seq, constraint_id] : names.results) {
    request.seq.push_back(seq);
    request.constraint_id.push_back(constraint_id);
  }
  request.num_verdicts = static_cast<int16_t>(request.seq.size());
  node.Publish(std::string(channels::kVerificationRequest), request);
  node.NoteResendAsked();
}

void AskForState(Node& node, const MapId& map) {
  RequestRetransmission(node, std::string(channels::kMapState), {map, 0, 0});
}

void MissingMessages::Announce(const Have& have) {
  for (const auto& [map, highest_seq] : have.highest_seq) {
    stream_.Announce(map, highest_seq);
  }
  for (const SeqGap& gap : have.gaps) {
    stream_.Skip(gap);
  }
}

void MissingStates::Note(const std::vector<MapId>& maps) {
  for (const MapId& map : maps) {
    times_asked_.erase(map);
  }
}

std::vector<MapId> MissingStates::Due(int64_t now_utime) {
  std::vector<MapId> due;
  if (now_utime < next_utime_) {
    return due;
  }
  next_utime_ = now_utime + timeouts::kStateInterval_us;
  for (auto it = times_asked_.begin(); it != times_asked_.end() && due.size() < kMaxAsked;) {
    due.push_back(it->first);
    it = ++it->second < timeouts::kMaxStateRequests ? std::next(it) : times_asked_.erase(it);
  }
  return due;
}

}  // namespace pangea
