#include "link/poll_loop.h"

#include <poll.h>

namespace pangea {
namespace {

constexpr int64_t kTickInterval_us = 100'000;
// Messages of one bus are handled for at most this time, then those of the other bus, then Poll is
// called. A flood of messages must not delay Poll, which sends at most one burst per call.
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
    pollfd fds[2] = {{a.fd(), POLLIN, 0}, {b.fd(), POLLIN, 0}};  // poll ignores fd -1
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
