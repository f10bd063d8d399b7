// The agent_handler with a new journal, and all channels of the link and the server bus that it
// reads.

#include "agent_handler/agent_handler_process.h"
#include "fuzz.h"
#include "link/agent_key.h"
#include "link_channels.h"

namespace pangea::fuzz {
namespace {

struct Files {
  Files() {
    std::filesystem::create_directories(keys);
    MakeKeyFile(key, 1);
  }
  const std::filesystem::path keys = ScratchFolder() / "keys";
  const std::filesystem::path key = keys / KeyFileName(1);
  const std::filesystem::path journal = ScratchFolder() / "journal.lcm";
};

// Seals the bodies that an input has on HELLO, PIECE, ...
class Agent {
 public:
  Agent(QuickBus* bus, const SecretKey& key) : session_(1, key) {
    for (const LinkKind kind :
         {LinkKind::kHello, LinkKind::kPiece, LinkKind::kLastPiece, LinkKind::kPose,
          LinkKind::kAnchorEdit, LinkKind::kAnchorsReceived}) {
      bus->Subscribe(ChannelOfKind(kind), [this, bus, kind](const std::string&, Bytes body) {
        bus->Publish("LINK_UP_1", session_.Seal({kind, ++number_, {body.begin(), body.end()}}));
      });
    }
    bus->Subscribe("LINK_DOWN_1",
                   [this](const std::string&, Bytes packet) { session_.Open(packet); });
    // The second one names the run that the answer to the first has named
    for (int i = 0; i < 2; ++i) {
      bus->Publish("HELLO", Encode(LinkHello{}));
      bus->Drain();
    }
  }

 private:
  UplinkSession session_;
  int64_t number_ = 0;
};

}  // namespace
}  // namespace pangea::fuzz

static int FuzzAgentHandler(const uint8_t* data, size_t size) {
  using namespace pangea;
  static const fuzz::Files files;
  static const SecretKey key = ReadKeyFileOf(files.key, 1);
  std::filesystem::remove(files.journal);
  fuzz::QuickBus bus;
  AgentHandlerProcess process(bus, bus, files.journal.string(), files.keys.string(), 1'000'000,
                              AgentHandlerOptions{});
  const fuzz::Agent agent(&bus, key);
  int64_t now_us = 1'000'000;
  fuzz::Play({data, size}, fuzz::HandlerChannels(), &bus, [&](int64_t wait_us) {
    now_us += wait_us;
    process.Poll(now_us);
    process.Tick(now_us);
  });
  return 0;
}
static const pangea::fuzz::Target kAgentHandler("agent_handler", FuzzAgentHandler);
