#include "bus/retransmission/gap_requests.h"

#include <algorithm>

#include "bus/retransmission/timeouts.h"

namespace pangea {

std::vector<SeqGap> GapRequests::Due(const std::vector<SeqGap>& gaps, int64_t now_utime) {
  std::vector<SeqGap> due;
  for (const SeqGap& gap : gaps) {
    Asked& asked = asked_[gap.map];
    const bool is_next_part = gap.from_seq == asked.to_seq + 1;
    if (gap.from_seq == asked.from_seq || is_next_part) {
      if (is_next_part || now_utime >= asked.next_utime) {
        const int32_t to_seq = std::min(gap.to_seq, gap.from_seq + timeouts::kMaxAsked - 1);
        asked = {gap.from_seq, to_seq, now_utime + timeouts::kRequestInterval_us,
                 is_next_part ? 1 : asked.times + 1};
        due.push_back({gap.map, gap.from_seq, to_seq});
      }
    } else if (gap.from_seq <= asked.to_seq) {  // a part of the answers has come
      asked = {gap.from_seq, asked.to_seq, now_utime + timeouts::kRequestInterval_us, 0};
    } else {
      asked = {gap.from_seq, kNothing, now_utime + timeouts::kGapWait_us, 0};
    }
  }
  return due;
}

void GapRequests::Expect(const MapId& map) { asked_.try_emplace(map, Asked{kNothing, -1, 0, 0}); }

int GapRequests::Requests(const MapId& map) const {
  const auto it = asked_.find(map);
  return it == asked_.end() ? 0 : it->second.times;
}

}  // namespace pangea
