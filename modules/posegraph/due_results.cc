#include "posegraph/due_results.h"

#include <algorithm>

#include "bus/retransmission/timeouts.h"
#include "core/server_messages.h"
#include "messages/catch_up_messages.h"

namespace pangea {

void DueResults::Promise(const PlaceMatch& match, int64_t now_utime) {
  for (const PlaceCandidate& candidate : match.candidates) {
    const int64_t promised = ConstraintId(match.query, candidate);
    if (!received_.contains(promised) && due_.size() < kMax) {
      Watch(promised, match.query, now_utime);
    }
  }
}

void DueResults::Watch(int64_t constraint_id, const KeyframeId& query, int64_t now_utime) {
  due_.try_emplace(constraint_id,
                   Due{query, now_utime + timeouts::kResultWait_us, timeouts::kResultWait_us});
}

void DueResults::Save(ByteWriter* writer) const {
  writer->Put(std::vector<int64_t>(received_.begin(), received_.end()));
  writer->PutCount(due_.size());
  for (const auto& [id, due] : due_) {
    writer->Put(id);
    writer->Put(due.query);
  }
}

void DueResults::Restore(ByteReader* reader, int64_t now_utime) {
  std::vector<int64_t> received;
  reader->Get(&received);
  received_ = {received.begin(), received.end()};
  for (size_t left = reader->GetCount(1); left > 0; --left) {
    int64_t id = 0;
    KeyframeId query;
    reader->Get(&id);
    reader->Get(&query);
    Watch(id, query, now_utime);
  }
}

bool DueResults::MarkReceived(int64_t constraint_id) {
  due_.erase(constraint_id);
  return received_.insert(constraint_id).second;
}

int64_t DueResults::NumToCatchUp(const JournalFollower& journal) const {
  return std::ranges::count_if(due_, [&journal](const auto& item) {
    const Due& due = item.second;
    const auto goal = journal.Goal(due.query.map);
    // A result requested twice without an answer is not in the journal: it is still to be verified.
    return goal && due.query.seq <= *goal && due.wait_us < 4 * timeouts::kResultWait_us;
  });
}

void DueResults::RequestOverdue(Node& node, int64_t now_utime) {
  constexpr int64_t kLookEvery_us = 1'000'000;
  if (now_utime < next_look_utime_) {
    return;
  }
  next_look_utime_ = now_utime + kLookEvery_us;
  std::map<MapId, ResultNames> overdue;
  for (auto& [id, due] : due_) {
    if (now_utime < due.next_ask_utime) {
      continue;
    }
    const MapId& map = due.query.map;
    ResultNames& names = overdue.try_emplace(map, ResultNames{map, {}}).first->second;
    if (names.results.size() < ResultNames::kMax) {
      due.wait_us = std::min(2 * due.wait_us, timeouts::kMaxResultWait_us);
      due.next_ask_utime = now_utime + due.wait_us;
      names.results.emplace_back(due.query.seq, id);
    }
  }
  for (const auto& [map, names] : overdue) {
    RequestResults(node, names);
  }
}

}  // namespace pangea
