// The uplink, and all channels of its agent's bus and of the link that it reads.

#include "fuzz.h"
#include "link_channels.h"
#include "uplink/uplink_process.h"

static int FuzzUplink(const uint8_t* data, size_t size) {
  using namespace pangea;
  fuzz::QuickBus bus;
  UplinkProcess process(bus, bus, 1, fuzz::AgentKey(), UplinkOptions{});
  HandlerSession server(1, fuzz::AgentKey());
  bus.Subscribe("LINK_UP_1", [&](const std::string&, Bytes packet) {
    if (const auto opened = server.Open(packet); !opened.welcome.empty()) {
      bus.Publish("LINK_DOWN_1", opened.welcome);
    }
  });
  for (const LinkKind kind : {LinkKind::kAck, LinkKind::kLandmarks, LinkKind::kOthers,
                              LinkKind::kAnchor, LinkKind::kAnchorEditAnswers}) {
    bus.Subscribe(fuzz::ChannelOfKind(kind), [&bus, &server, kind](const std::string&, Bytes body) {
      if (server.HasUplink()) {
        bus.Publish("LINK_DOWN_1", server.Seal(kind, {body.begin(), body.end()}));
      }
    });
  }
  int64_t now_us = 1'000'000;
  const auto poll = [&](int64_t wait_us) {
    now_us += wait_us;
    process.Poll(now_us);
    process.Tick(now_us);
  };
  for (int i = 0; i < 3; ++i) {  // until there is a session
    poll(1'000'000);
    bus.Drain();
  }
  fuzz::Play({data, size}, fuzz::UplinkChannels(), &bus, poll);
  return 0;
}
static const pangea::fuzz::Target kUplink("uplink", FuzzUplink);
