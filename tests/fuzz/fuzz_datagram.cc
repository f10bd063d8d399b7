// Datagrams of several senders on a multicast bus, one after the other, as a receiver assembles
// them below the level of channels. A step's channel is the sender.

#include "bus/transport/udpm_assembler.h"
#include "fuzz.h"

namespace pangea::fuzz {
namespace {

int64_t Refused(const UdpmAssembler& assembler) {
  int64_t refused = 0;
  for (const auto& [reason, count] : assembler.refused()) {
    Require(!reason.empty() && count > 0, "a refusal has a reason");
    refused += count;
  }
  return refused;
}

// Reads all bytes, so that the address sanitizer checks them.
void Use(const UdpmAssembler::Message& message) {
  Require(!message.channel.empty() && message.channel.size() <= UdpmAssembler::kMaxChannel &&
              message.channel.find('\0') == std::string::npos,
          "a channel has 1 to 63 characters");
  Require(message.data.size() <= UdpmAssembler::kMaxMessage, "messages are bounded");
  const std::vector<uint8_t> copy(message.data.begin(), message.data.end());
  Require(copy.size() == message.data.size(), "all of it is there");
}

}  // namespace
}  // namespace pangea::fuzz

static int FuzzDatagram(const uint8_t* data, size_t size) {
  using namespace pangea;
  UdpmAssembler assembler;
  size_t received = 0;
  for (const fuzz::Step& step : fuzz::Steps({data, size})) {
    const int64_t refused = fuzz::Refused(assembler);
    const size_t waited = assembler.partial_bytes();
    received += step.data.size();
    const auto message = assembler.Take(step.data, static_cast<uint64_t>(step.channel));
    if (message) {
      fuzz::Use(*message);
      fuzz::Require(message->data.size() <= received, "nothing comes that nobody sent");
    } else {
      fuzz::Require(fuzz::Refused(assembler) > refused || assembler.partial_bytes() > waited,
                    "what brings no message is refused or waits");
    }
    fuzz::Require(assembler.partials() <= UdpmAssembler::kMaxPartials &&
                      assembler.partial_bytes() <= UdpmAssembler::kMaxPartialBytes,
                  "what waits is bounded");
    fuzz::Require((assembler.partials() == 0) == (assembler.partial_bytes() == 0),
                  "what is gone takes no memory");
  }
  return 0;
}
static const pangea::fuzz::Target kDatagram("datagram", FuzzDatagram);
