// A bus with ttl=0 receives nothing from other hosts (udpm_socket.h).

#include <arpa/inet.h>
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <linux/if_tun.h>
#include <net/if.h>
#include <netinet/ip.h>
#include <netinet/udp.h>
#include <sched.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <cstdlib>
#include <cstring>

#include "bus/transport/test_datagrams.h"

namespace pangea {
namespace {

constexpr uint16_t kPort = 7701;
constexpr char kGroup[] = "239.255.76.67";
constexpr char kOutsider[] = "10.77.1.2";
constexpr char kThisHost[] = "10.77.1.1";

void Append(const void* data, size_t size, std::vector<uint8_t>* bytes) {
  const auto* begin = static_cast<const uint8_t*>(data);
  bytes->insert(bytes->end(), begin, begin + size);
}

uint16_t Checksum(const iphdr& header) {
  uint16_t words[sizeof(iphdr) / 2];
  std::memcpy(words, &header, sizeof(words));
  uint32_t sum = 0;
  for (const uint16_t word : words) {
    sum += word;
  }
  sum = (sum & 0xffff) + (sum >> 16);
  return static_cast<uint16_t>(~(sum + (sum >> 16)));
}

std::vector<uint8_t> IpPacket(const std::string& to, const std::vector<uint8_t>& payload) {
  const auto udp_size = static_cast<uint16_t>(sizeof(udphdr) + payload.size());
  iphdr ip{};
  ip.version = 4;
  ip.ihl = sizeof(ip) / 4;
  ip.tot_len = htons(static_cast<uint16_t>(sizeof(ip) + udp_size));
  ip.ttl = 1;
  ip.protocol = IPPROTO_UDP;
  ip.saddr = inet_addr(kOutsider);
  ip.daddr = inet_addr(to.c_str());
  ip.check = Checksum(ip);
  udphdr udp{};
  udp.source = htons(40000);
  udp.dest = htons(kPort);
  udp.len = htons(udp_size);
  std::vector<uint8_t> packet;
  Append(&ip, sizeof(ip), &packet);
  Append(&udp, sizeof(udp), &packet);
  Append(payload.data(), payload.size(), &packet);
  return packet;
}

// A network namespace with loopback and one cable, whose other end the test holds.
class Outside {
 public:
  // False if the machine does not permit that.
  bool Open() {
    if (unshare(CLONE_NEWNET) != 0) {
      return false;
    }
    fd_ = open("/dev/net/tun", O_RDWR | O_CLOEXEC);
    ifreq request{};
    request.ifr_flags = IFF_TUN | IFF_NO_PI;
    std::strncpy(request.ifr_name, "cable", IFNAMSIZ);
    return fd_ >= 0 && ioctl(fd_, TUNSETIFF, &request) == 0 &&
           std::system(
               "ip link set lo up && ip link set cable up && "
               "ip address add 10.77.1.1/24 dev cable && "
               "ip route add 224.0.0.0/4 dev cable") == 0;
  }
  void Send(const std::string& to, const std::string& channel) const {
    const std::vector<uint8_t> packet = IpPacket(to, ShortDatagram(channel + std::string(1, '\0')));
    ASSERT_EQ(write(fd_, packet.data(), packet.size()), static_cast<ssize_t>(packet.size()));
  }

 private:
  int fd_ = -1;
};

std::vector<std::string> Heard(LcmBus& bus, std::vector<std::string>* heard) {
  while (bus.Handle(200)) {
  }
  return std::exchange(*heard, {});
}

TEST(HostOnly, TakesNothingFromOutside) {
  Outside outside;
  if (!outside.Open()) {
    GTEST_SKIP() << "network namespaces and TUN devices are not permitted here";
  }
  const std::string url = std::string("udpm://") + kGroup + ":" + std::to_string(kPort) + "?ttl=";
  std::vector<std::string> heard;
  const auto note = [&](const std::string& channel, Bytes) { heard.push_back(channel); };

  LcmBus open_bus(url + "1");
  open_bus.Subscribe(".*", note);
  outside.Send(kThisHost, "STRAIGHT");
  outside.Send(kGroup, "MULTICAST");
  EXPECT_THAT(Heard(open_bus, &heard), testing::ElementsAre("STRAIGHT", "MULTICAST"));

  LcmBus own_bus(url + "0");
  own_bus.Subscribe(".*", note);
  outside.Send(kThisHost, "STRAIGHT");
  outside.Send(kGroup, "MULTICAST");
  EXPECT_THAT(Heard(own_bus, &heard), testing::IsEmpty());
  const std::vector<uint8_t> large(50'000);  // several frames
  own_bus.Publish("OWN", {});
  own_bus.Publish("LARGE", large);
  EXPECT_THAT(Heard(own_bus, &heard), testing::ElementsAre("OWN", "LARGE"));
}

}  // namespace
}  // namespace pangea
