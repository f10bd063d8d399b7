#include "agent_handler/journal/anchor_edits.h"

#include <algorithm>
#include <utility>

#include "bus/retransmission/missing.h"
#include "messages/anchor_messages.h"
#include "messages/catch_up_messages.h"
#include "messages/channels.h"
#include "messages/encoding.h"

namespace pangea {

AnchorEdits::Key AnchorEdits::KeyOf(const AnchorEdit& edit) {
  return {edit.anchor.created_utime, edit.revision, static_cast<uint16_t>(edit.anchor.agent_id),
          static_cast<uint16_t>(edit.agent_id)};
}

void AnchorEdits::Index(const AnchorEdit& edit, const JournalPlace& place) {
  const auto index = static_cast<size_t>(edit.seq);
  if (index >= places_.size()) {
    places_.resize(index + 1);
  }
  places_[index] = place;
  seq_of_.emplace(KeyOf(edit), static_cast<int32_t>(edit.seq));
  next_seq_ = std::max(next_seq_, edit.seq + 1);
}

bool AnchorEdits::Load(Bytes data, const JournalPlace& place) {
  const auto edit = ParseMessage<anchor_edit_t>(data);
  if (!edit.value) {
    return false;
  }
  const int64_t seq = edit.value->seq;
  const bool repeat = seq < next_seq_ && seq >= 0 && places_[static_cast<size_t>(seq)].size > 0;
  if (seq < 0 || seq >= kMaxEdits || repeat) {
    return true;
  }
  if (seq + 1 > next_seq_) {
    newest_.assign(data.begin(), data.end());
  }
  Index(*edit.value, place);
  kept_seq_ = next_seq_;
  return true;
}

AnchorEdits::Taken AnchorEdits::Take(AnchorEdit edit, int64_t utime, Journal* journal) {
  if (const auto known = seq_of_.find(KeyOf(edit)); known != seq_of_.end()) {
    return known->second < kept_seq_ ? Taken::kJournalled : Taken::kQueued;
  }
  if (next_seq_ >= kMaxEdits) {
    return Taken::kFull;
  }
  if (journal->Full()) {
    return Taken::kBusy;
  }
  edit.seq = next_seq_;
  std::vector<uint8_t> bytes = EncodeMessage(ToMessage(edit));
  Index(edit, journal->Append(utime, std::string(channels::kAnchorEdit), bytes));
  queued_.push_back({std::move(edit), std::move(bytes)});
  return Taken::kQueued;
}

void AnchorEdits::OnKept(int64_t num_edits) {
  for (; !queued_.empty() && queued_.front().edit.seq < num_edits; queued_.pop_front()) {
    Queued& queued = queued_.front();
    node_.bus().Publish(std::string(channels::kAnchorEdit), queued.bytes);
    newest_ = std::move(queued.bytes);
    journalled_.push_back(std::move(queued.edit));
  }
  kept_seq_ = std::max(kept_seq_, num_edits);
}

void AnchorEdits::PublishNewest() {
  if (!newest_.empty()) {
    node_.bus().Publish(std::string(channels::kAnchorEdit), newest_);
  }
}

std::string AnchorEdits::OnResendRequest(const resend_request_t& message) {
  const auto parsed = Parse(message);
  if (!parsed.value) {
    return parsed.refused;
  }
  const Request request{
      parsed.value->requester, parsed.value->range.from_seq,
      static_cast<int32_t>(std::min<int64_t>(parsed.value->range.to_seq, kept_seq_ - 1))};
  const bool covered = std::ranges::any_of(requests_, [&](const Request& r) {
    return r.requester == request.requester && r.next_seq <= request.next_seq &&
           request.to_seq <= r.to_seq;
  });
  if (covered || request.to_seq < request.next_seq) {
    return "";
  }
  if (requests_.size() >= kMaxRequests) {
    return "too many resend requests are waiting";
  }
  requests_.push_back(request);
  return "";
}

// If an edit was lost by damage, the next one is sent with its number. Applying an edit twice does
// no harm, and without this, followers would ask for the lost edit for ever.
int64_t AnchorEdits::AnswerNext(const Journal& journal) {
  if (requests_.empty()) {
    return 0;
  }
  Request& request = requests_.front();
  const std::string requester = request.requester;
  const int32_t seq = request.next_seq;
  if (++request.next_seq > request.to_seq) {
    requests_.pop_front();
  }
  const auto there = std::find_if(places_.begin() + seq, places_.end(),
                                  [](const JournalPlace& place) { return place.size > 0; });
  anchor_edit_t edit{};
  const std::vector<uint8_t> bytes = journal.Read(*there);
  if (!DecodeMessage(bytes, &edit)) {
    node_.Count("journal_reads_failed");
    return 1;
  }
  edit.seq = seq;
  Retransmit(node_, requester, std::string(channels::kAnchorEdit), edit);
  node_.Count("retransmitted");
  return static_cast<int64_t>(bytes.size());
}

}  // namespace pangea
