// Sends a pose correction as a message on a bus, and converts it back to a domain type.

#include <cstdio>
#include <vector>

#include "bus/bus.h"
#include "messages/channels.h"
#include "messages/messages.h"

int main() {
  pangea::LocalBus bus;
  double x = 0;
  bus.Subscribe(std::string(pangea::channels::kAllCorrections),
                [&x](const std::string&, pangea::Bytes data) {
                  pangea::correction_t message{};
                  message.decode(data.data(), 0, static_cast<int>(data.size()));
                  const auto parsed = pangea::Parse(message);
                  if (!parsed.value) {
                    std::puts(parsed.refused.c_str());
                    return;
                  }
                  x = parsed.value->T_map_odom.t.x();
                });

  pangea::Correction correction;
  correction.map = {7, 1};
  correction.group = {7, 1};
  correction.revision = 1;
  correction.T_map_odom.t.x() = 2.5;
  const pangea::correction_t message = pangea::ToMessage(correction);
  std::vector<uint8_t> bytes(message.getEncodedSize());
  message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  bus.Publish(pangea::channels::Correction(7), bytes);
  bus.Drain();
  std::printf("x = %.1f\n", x);
  return x == 2.5 ? 0 : 1;
}
