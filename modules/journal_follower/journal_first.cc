#include "journal_follower/journal_first.h"

#include <utility>

#include "messages/channels.h"

namespace pangea {

void JournalFirstBus::Subscribe(const std::string& channel_regex, Handler handler) {
  const Handler* kept = &handlers_.emplace_back(std::move(handler));
  bus_.Subscribe(channel_regex, [this, kept](const std::string& channel, Bytes data) {
    if (open_ || channel == channels::kHave || channel == channels::kJournalFile) {
      have_received_ = have_received_ || channel == channels::kHave;
      (*kept)(channel, data);
    } else if (waiting_.size() < kMaxWaiting) {
      waiting_.push_back({kept, channel, {data.begin(), data.end()}});
    }
  });
}

void JournalFirstBus::Poll(int64_t now_utime) {
  if (open_ || (!have_received_ && now_utime < begin_utime_ + kLongest_us)) {
    return;
  }
  open_ = true;
  for (; !waiting_.empty(); waiting_.pop_front()) {
    const Waiting& next = waiting_.front();
    (*next.handler)(next.channel, next.data);
  }
}

}  // namespace pangea
