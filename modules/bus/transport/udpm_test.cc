// Tests buses over multicast in one process on this host, while strangers send packets as well.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <thread>

#include "bus/node.h"
#include "bus/transport/test_datagrams.h"
#include "bus/transport/udpm_receiver.h"
#include "bus/transport/udpm_socket.h"

namespace pangea {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::ThrowsMessage;

class UdpmTest : public testing::Test {
 protected:
  void Listen(LcmBus* bus) {
    bus->Subscribe("A|LARGE", [this](const std::string& channel, Bytes data) {
      heard.push_back(channel + " " + std::to_string(data.size()));
    });
  }
  std::vector<std::string> Heard(LcmBus* bus) {
    while (bus->Handle(200)) {
    }
    return std::exchange(heard, {});
  }

  const std::string url = OwnBusUrl();
  std::vector<std::string> heard;
};

TEST_F(UdpmTest, CarriesMessagesLargeAndSmall) {
  LcmBus from(url), to(url);
  Listen(&to);
  from.Publish("A", {});
  from.Publish("LARGE", std::vector<uint8_t>(70'000));
  from.Publish("LARGE", std::vector<uint8_t>(1'000'000));
  from.Publish("B", {});
  from.Publish("AA", {});
  from.Publish("A", std::vector<uint8_t>(60'000));
  EXPECT_THAT(Heard(&to), ElementsAre("A 0", "LARGE 70000", "LARGE 1000000", "A 60000"));
  EXPECT_THAT(to.undelivered().refused, IsEmpty());
}

TEST_F(UdpmTest, MalformedDatagramsStopNobody) {
  LcmBus bus(url);
  Listen(&bus);
  const DatagramSender stranger(url);
  for (int round = 0; round < 5; ++round) {
    for (const Datagram& datagram : MalformedDatagrams("A")) {
      ASSERT_TRUE(stranger.Send(datagram));
    }
    bus.Publish("A", {});
    bus.Publish("LARGE", std::vector<uint8_t>(100'000));
    EXPECT_THAT(Heard(&bus), ElementsAre("A 0", "LARGE 100000"));
  }
  EXPECT_EQ(bus.undelivered().refused["fragment: beyond its message"], 25);
  EXPECT_EQ(bus.undelivered().by_kernel, 15) << "three of them are not even LCM's";
}

TEST_F(UdpmTest, WhatIsRefusedShowsInTheStatus) {
  LcmBus bus(url);
  Node node(bus, "test");
  node.SubscribeBytes("A", [](const std::string&, Bytes) {});
  const DatagramSender stranger(url);
  ASSERT_TRUE(stranger.Send(MalformedDatagrams("A").front()));
  ASSERT_TRUE(stranger.Send({'x'}));
  Heard(&bus);
  const status_t status = node.Status(0, 0, "");
  ASSERT_EQ(status.num_refused, 1);
  EXPECT_EQ(status.refused[0].name, "fragment: beyond its message");
  EXPECT_EQ(status.refused[0].count, 1);
  EXPECT_EQ(CounterOf(status, "lost_in_kernel"), 1);
  EXPECT_EQ(CounterOf(status, "lost_in_queue"), std::nullopt);
}

TEST_F(UdpmTest, AnotherGroupOnThePortIsAnotherBus) {
  LcmBus bus(url), other("udpm://239.255.76.99" + url.substr(url.rfind(':')));
  Listen(&bus);
  other.Subscribe("B", [](const std::string&, Bytes) {});
  other.Publish("A", std::vector<uint8_t>(1));
  bus.Publish("A", std::vector<uint8_t>(2));
  EXPECT_THAT(Heard(&bus), ElementsAre("A 2"));
}

TEST_F(UdpmTest, TheLinkTakesNoFragments) {
  LcmBus bus(url, LcmBus::Fragments::kRefused);
  Listen(&bus);
  const DatagramSender stranger(url);
  for (const Datagram& datagram : MalformedDatagrams("A")) {
    ASSERT_TRUE(stranger.Send(datagram));
  }
  bus.Publish("LARGE", std::vector<uint8_t>(100'000));
  bus.Publish("A", std::vector<uint8_t>(60'000));
  EXPECT_THAT(Heard(&bus), ElementsAre("A 60000"));
  EXPECT_EQ(bus.undelivered().by_kernel, 13 + 3 + 2) << "all fragments, and what is not LCM's";
}

// Publishes messages of 0, 1, ... bytes on A, slowly: the kernel keeps few.
void Flood(LcmBus* bus, size_t count) {
  for (size_t i = 0; i < count; ++i) {
    bus->Publish("A", std::vector<uint8_t>(i));
    if (i % 20 == 0) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  }
}

void AwaitDrops(LcmBus* bus, int64_t count) {
  for (int i = 0; i < 500 && bus->undelivered().no_room < count; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
}

TEST_F(UdpmTest, WhatWaitsIsBoundedAndTheNewestIsDropped) {
  LcmBus bus(url);
  std::vector<size_t> sizes;
  bus.Subscribe("A", [&](const std::string&, Bytes data) { sizes.push_back(data.size()); });
  int others = 0;
  bus.Subscribe("B", [&](const std::string&, Bytes) { ++others; });
  constexpr size_t kSent = UdpmReceiver::kMaxWaiting + 300;
  Flood(&bus, kSent);
  bus.Publish("B", {});
  AwaitDrops(&bus, 300);
  Heard(&bus);
  EXPECT_EQ(others, 1) << "one subscription's flood leaves room for another's";
  ASSERT_EQ(sizes.size(), UdpmReceiver::kMaxWaiting);
  EXPECT_EQ(sizes.back(), UdpmReceiver::kMaxWaiting - 1);
  EXPECT_EQ(bus.undelivered().no_room, 300);
}

TEST_F(UdpmTest, AMessageThatOneOfTwoSubscriptionsMissesIsCounted) {
  LcmBus bus(url);
  int heard = 0;
  bus.Subscribe("A.*", [&](const std::string&, Bytes) { ++heard; });
  int heard_b = 0;
  bus.Subscribe(".*B", [&](const std::string&, Bytes) { ++heard_b; });
  constexpr size_t kSent = UdpmReceiver::kMaxWaiting + 20;
  Flood(&bus, kSent);
  bus.Publish("AB", {});
  AwaitDrops(&bus, 21);
  Heard(&bus);
  EXPECT_EQ(heard, static_cast<int>(UdpmReceiver::kMaxWaiting));
  EXPECT_EQ(heard_b, 1);
  EXPECT_EQ(bus.undelivered().no_room, 20 + 1);
}

TEST_F(UdpmTest, TheBytesThatWaitAreBounded) {
  LcmBus bus(url);
  int heard_large = 0;
  bus.Subscribe("LARGE", [&](const std::string&, Bytes) { ++heard_large; });
  constexpr int64_t kSent = 1200;
  for (int i = 0; i < kSent; ++i) {
    bus.Publish("LARGE", std::vector<uint8_t>(65'000));
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  Heard(&bus);
  EXPECT_LE(heard_large, static_cast<int>(UdpmReceiver::kMaxWaitingBytes / 65'000));
  const Bus::Undelivered undelivered = bus.undelivered();
  EXPECT_GT(undelivered.no_room, 0);
  EXPECT_EQ(heard_large + undelivered.no_room + undelivered.by_kernel, kSent);
  bus.Publish("LARGE", {});
  bus.Handle(1000);
  EXPECT_GT(heard_large, 0);
}

TEST_F(UdpmTest, CanBePolledOn) {
  LcmBus bus(url);
  pollfd waits{bus.fd(), POLLIN, 0};
  Listen(&bus);
  EXPECT_EQ(poll(&waits, 1, 0), 0);
  bus.Publish("A", {});
  bus.Publish("A", {});
  EXPECT_EQ(poll(&waits, 1, 2000), 1);
  EXPECT_TRUE(bus.Handle(1000));
  EXPECT_TRUE(bus.Handle(1000));
  EXPECT_FALSE(bus.MoreWaits());
  EXPECT_FALSE(bus.Handle(20));
  EXPECT_EQ(poll(&waits, 1, 0), 0);
}

TEST_F(UdpmTest, AHandlersExceptionComesOutAndItsSubscriptionCounts) {
  LcmBus bus(url);
  bus.Subscribe("A", [&](const std::string&, Bytes) {
    Listen(&bus);
    throw std::logic_error("of a handler");
  });
  bus.Publish("A", {});
  EXPECT_THROW(bus.Handle(1000), std::logic_error);
  bus.Publish("LARGE", {});
  EXPECT_THAT(Heard(&bus), ElementsAre("LARGE 0"));
}

// This test is meant for the thread sanitizer.
TEST_F(UdpmTest, OthersMayPublishWhileMessagesAreHandled) {
  LcmBus bus(url);
  int count = 0;
  bus.Subscribe("T[0-9]", [&](const std::string&, Bytes) { ++count; });
  std::vector<std::thread> threads;
  for (int i = 0; i < 3; ++i) {
    threads.emplace_back([&bus, channel = "T" + std::to_string(i)] {
      for (int n = 0; n < 100; ++n) {
        bus.Publish(channel, std::vector<uint8_t>(100));
        std::this_thread::sleep_for(std::chrono::microseconds(200));
      }
    });
  }
  for (int i = 0; count < 300 && i < 400; ++i) {
    bus.Handle(10);
    if (i % 50 == 0) {
      bus.Subscribe("LATE_" + std::to_string(i), [](const std::string&, Bytes) {});
      bus.undelivered();
    }
  }
  for (std::thread& thread : threads) {
    thread.join();
  }
  Heard(&bus);
  EXPECT_EQ(count, 300);
}

TEST(UdpmUrl, IsReadAsLcmDoes) {
  const UdpmAddress address = ParseUdpmUrl("udpm://239.255.76.68:7668?ttl=1&recv_buf_size=4194304");
  EXPECT_EQ(ntohl(address.group.s_addr), 0xefff4c44);
  EXPECT_EQ(address.port, 7668);
  EXPECT_EQ(address.ttl, 1);
  EXPECT_EQ(address.recv_buf_size, 4194304);
  const UdpmAddress defaults = ParseUdpmUrl("udpm://");
  EXPECT_EQ(ntohl(defaults.group.s_addr), 0xefff4c43);
  EXPECT_EQ(defaults.port, 7667);
  EXPECT_EQ(defaults.ttl, 0);
  EXPECT_EQ(defaults.recv_buf_size, 4194304);
  EXPECT_EQ(ParseUdpmUrl("udpm://239.1.2.3").port, 7667);
  EXPECT_EQ(ParseUdpmUrl("udpm://239.1.2.3:1?recv_buf_size=1,ttl=10").ttl, 10);
}

int ReceiveBufferOf(const std::string& url) {
  const int socket = OpenUdpmSocket(ParseUdpmUrl(url), LcmBus::Fragments::kJoined);
  int bytes = 0;
  socklen_t size = sizeof bytes;
  EXPECT_EQ(getsockopt(socket, SOL_SOCKET, SO_RCVBUF, &bytes, &size), 0);
  close(socket);
  return bytes;
}

// Without a buffer size in the URL, bursts must not be lost either.
TEST(UdpmUrl, WithoutABufferSizeTheSocketHasAsMuchAsInTheDefaultUrl) {
  const std::string url = "udpm://239.255.76.67:20011?ttl=0";
  EXPECT_EQ(ReceiveBufferOf(url), ReceiveBufferOf(url + "&recv_buf_size=4194304"));
  EXPECT_GT(ReceiveBufferOf(url), ReceiveBufferOf(url + "&recv_buf_size=100000"));
}

// The kernel grants at most net.core.rmem_max.
TEST(UdpmUrl, ABufferSmallerThanAskedForIsSaidWithWhatToDo) {
  testing::internal::CaptureStderr();
  ReceiveBufferOf("udpm://239.255.76.67:20011?ttl=0&recv_buf_size=2000000000");
  EXPECT_THAT(testing::internal::GetCapturedStderr(),
              testing::HasSubstr("sysctl -w net.core.rmem_max=2000000000"));
  testing::internal::CaptureStderr();
  ReceiveBufferOf("udpm://239.255.76.67:20011?ttl=0&recv_buf_size=100000");
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

TEST(UdpmUrl, WhatMakesNoSenseIsAnErrorThatNamesIt) {
  const std::pair<const char*, const char*> kUrls[] = {
      {"udpm://127.0.0.1:7667", "'127.0.0.1' is no multicast address"},
      {"udpm://239.1.2.3:port", "the port 'port' is no number from 1 to 65535"},
      {"udpm://239.1.2.3:70000", "the port '70000'"},
      {"udpm://239.1.2.3:0", "the port '0'"},
      {"udpm://239.1.2.3:7667?ttl=near", "ttl 'near' is no number from 0 to 255"},
      {"udpm://239.1.2.3:7667?ttl=256", "ttl '256'"},
      {"udpm://239.1.2.3:7667?recv_buf_size=-1", "recv_buf_size '-1'"},
      {"udp://239.1.2.3:7667", "give udpm://, tcpq://, memq:// or file://"},
  };
  for (const auto& [bad, reason] : kUrls) {
    EXPECT_THAT(
        [url = bad] { LcmBus{url}; },
        ThrowsMessage<std::runtime_error>(testing::AllOf(
            HasSubstr("cannot open the bus '" + std::string(bad) + "'"), HasSubstr(reason))));
  }
}

}  // namespace
}  // namespace pangea
