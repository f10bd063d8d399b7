#include "bus/options_announcer.h"

#include "messages/channels.h"
#include "pangea/options_t.hpp"

namespace pangea {

void OptionsAnnouncer::Tick(int64_t now_utime) {
  if (now_utime < next_utime_) {
    return;
  }
  next_utime_ = now_utime + kInterval_us;
  started_utime_ = started_utime_ == 0 ? now_utime : started_utime_;
  options_t message{};
  message.process = process_;
  message.utime = started_utime_;
  message.yaml = yaml_;
  PublishMessage(bus_, channels::Options(process_), message);
}

}  // namespace pangea
