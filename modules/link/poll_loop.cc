#include "link/poll_loop.h"

#include <poll.h>

namespace pangea {
namespace {

constexpr int64_t kTickInterval_us = 100'000;
// Messages of one bus are handled for so long before the other has its turn and Poll may send: a
// flood of them must not take the time between two Polls, which send no more than a burst each.
constexpr int64_t kBatch_us = 2'000;

void HandleWaiting(LcmBus& bus) {
  const int64_t end = SteadyMicros() + kBatch_us;
  while (bus.Handle(0) && SteadyMicros() < end) {
  }
}

}  // namespace

int RunPolledProcess(LcmBus& a, LcmBus& b, PolledProcess& process, OptionsAnnouncer& options) {
  InstallSignalHandlers();
  int64_t next_tick = 0;
  int timeout_ms = 0;
  while (!StopRequested()) {
    pollfd fds[2] = {{a.fd(), POLLIN, 0}, {b.fd(), POLLIN, 0}};  // poll leaves out negative ones
    poll(fds, 2, a.MoreWaits() || b.MoreWaits() ? 0 : timeout_ms);
    HandleWaiting(a);
    HandleWaiting(b);
    timeout_ms = process.Poll(SteadyMicros());
    const int64_t now = SteadyMicros();
    if (now >= next_tick) {
      options.Tick(WallUtime());
      process.Tick(WallUtime());
      next_tick = now + kTickInterval_us;
    }
  }
  return 0;
}

}  // namespace pangea
