#include "cluster/standby.h"

#include <fmt/format.h>

namespace pangea {

Standby::Standby(const std::filesystem::path& journal, SiteStreams& streams,
                 const std::string& holder)
    : journal_(journal), streams_(streams), lease_(streams, holder), copy_(journal, streams) {
  streams_.ListenToSigns();
}

// The journal is followed again after the term is stored: until then the former core may write.
bool Standby::Step(int64_t now_utime) {
  while (const auto holder = streams_.NextSign()) {
    lease_.NoteSign(*holder, now_utime);
  }
  const bool more = copy_.Follow();
  if (begin_ == 0 && !more && lease_.TryAcquire(now_utime)) {
    begin_ = StoreTerm(streams_, lease_.term());
    copy_.Follow();
  }
  if (begin_ > 0 && !lease_.Renew(now_utime)) {
    begin_ = 0;
  }
  if (begin_ == 0 || copy_.cursor().sequence < begin_) {
    return false;
  }
  copy_.cursor().Write(journal_);
  return true;
}

std::string Standby::Said() const {
  return fmt::format(
      "{}: {} bytes are as in NATS{}",
      begin_ > 0 ? std::string("has the site")
                 : fmt::format("stands by, {} has the site", lease_.seen_holder()),
      copy_.cursor().file.num_bytes,
      copy_.cut().empty() ? "" : "; what nobody was told is kept was cut off: " + copy_.cut());
}

}  // namespace pangea
