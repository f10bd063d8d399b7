// Tests buses over LCM's own relay while it is killed, stopped and restarted.

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <memory>

#include "bus/transport/tcpq_connection.h"

namespace pangea {
namespace {

using Clock = std::chrono::steady_clock;

double SecondsSince(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

// A port that is free at the moment.
uint16_t FreePort() {
  const int fd = socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof(address);
  bind(fd, reinterpret_cast<sockaddr*>(&address), sizeof(address));
  getsockname(fd, reinterpret_cast<sockaddr*>(&address), &size);
  close(fd);
  return ntohs(address.sin_port);
}

class Relay {
 public:
  explicit Relay(uint16_t port) {
    const std::string text = fmt::format("{}", port);
    pid_ = fork();
    if (pid_ == 0) {
      execlp("java", "java", "-cp", "/usr/share/java/lcm.jar", "lcm.lcm.TCPService", text.c_str(),
             static_cast<char*>(nullptr));
      _exit(127);
    }
  }
  ~Relay() {
    kill(pid_, SIGKILL);
    waitpid(pid_, nullptr, 0);
  }
  void Signal(int signal) const { kill(pid_, signal); }

 private:
  pid_t pid_;
};

class TcpqTest : public testing::Test {
 protected:
  void SetUp() override {
    if (access("/usr/share/java/lcm.jar", R_OK) != 0) {
      GTEST_SKIP() << "no lcm.jar: install liblcm-java";
    }
    to.Subscribe("A_[0-9]+", [this](const std::string&, Bytes data) {
      got.emplace_back(data.begin(), data.end());
    });
  }
  void StartRelay() { relay = std::make_unique<Relay>(port); }
  // Publishes until something arrives.
  bool Passes() {
    const auto begin = Clock::now();
    got.clear();
    while (got.empty() && SecondsSince(begin) < 15) {
      from.Publish("A_1", kProbe);
      from.Handle(20);
      to.Handle(20);
    }
    const bool passes = !got.empty();
    while (to.Handle(200)) {
    }
    return passes;
  }
  // The seconds that it takes to publish `count` messages of 30 kB, whether or not they are
  // received.
  double PublishMany(int count) {
    const auto begin = Clock::now();
    for (int i = 0; i < count; ++i) {
      from.Publish("A_2", std::vector<uint8_t>(30'000));
      from.Handle(0);
    }
    return SecondsSince(begin);
  }

  const std::vector<uint8_t> kProbe{42};
  const uint16_t port = FreePort();
  const std::string url = fmt::format("tcpq://127.0.0.1:{}", port);
  std::unique_ptr<Relay> relay;
  LcmBus from{url}, to{url};
  std::vector<std::vector<uint8_t>> got;
};

TEST_F(TcpqTest, CarriesMessagesInOrder) {
  StartRelay();
  ASSERT_TRUE(Passes());
  got.clear();
  std::vector<std::vector<uint8_t>> sent;
  for (int i = 0; i < 50; ++i) {
    sent.emplace_back(static_cast<size_t>(1300 * i), static_cast<uint8_t>(i));
    from.Publish("A_7", sent.back());
    from.Publish("B", sent.back());
  }
  for (const auto begin = Clock::now(); got.size() < sent.size() && SecondsSince(begin) < 15;) {
    from.Handle(0);
    to.Handle(20);
    std::erase(got, kProbe);  // one may have been late
  }
  EXPECT_TRUE(got == sent) << got.size();
}

TEST_F(TcpqTest, TheRelayMayComeLateAndDieAndComeBack) {
  EXPECT_LT(PublishMany(100), 1.0);
  EXPECT_FALSE(to.Handle(10));
  for (int round = 0; round < 2; ++round) {
    StartRelay();
    EXPECT_TRUE(Passes());
    relay.reset();
    EXPECT_LT(PublishMany(100), 1.0);
    EXPECT_FALSE(to.Handle(10) && to.Handle(10) && from.fd() >= 0);
  }
}

TEST_F(TcpqTest, AStoppedRelayBlocksNobody) {
  StartRelay();
  ASSERT_TRUE(Passes());
  relay->Signal(SIGSTOP);
  EXPECT_LT(PublishMany(2000), 5.0) << "60 MB, of which some are kept and the rest dropped";
  LcmBus late(url);
  late.Publish("A_1", {});
  EXPECT_FALSE(late.Handle(100)) << "it is connected, but gets no greeting";
  relay->Signal(SIGCONT);
  EXPECT_TRUE(Passes());
}

// The relay blocks on a client that reads nothing. Messages are lost then, but no other client
// blocks, and when the client reads again or ends, messages flow again.
TEST_F(TcpqTest, AStoppedClientBlocksNobodyElse) {
  StartRelay();
  ASSERT_TRUE(Passes());
  {
    LcmBus stopped(url);
    int before = 0;
    stopped.Subscribe("A_.*", [&](const std::string&, Bytes) { ++before; });
    for (int i = 0; i < 200 && before == 0; ++i) {
      stopped.Handle(20);
      from.Publish("A_1", std::vector<uint8_t>{1});
      from.Handle(0);
    }
    ASSERT_GT(before, 0);
    EXPECT_LT(PublishMany(2000), 5.0);
  }
  EXPECT_TRUE(Passes());
}

// The text that stderr receives while the bus is handled for this number of seconds.
std::string SaidMeanwhile(LcmBus* bus, double seconds) {
  testing::internal::CaptureStderr();
  for (const auto begin = Clock::now(); SecondsSince(begin) < seconds;) {
    bus->Handle(10);
  }
  return testing::internal::GetCapturedStderr();
}

TEST_F(TcpqTest, ARelayThatIsNotThereIsSaidOnceAndSoIsItsComing) {
  EXPECT_EQ(SaidMeanwhile(&to, 1), "") << "it may be on its way";
  const std::string said = SaidMeanwhile(&to, 3);
  EXPECT_THAT(said, testing::StartsWith(url + ": no relay there (Connection refused)"));
  EXPECT_THAT(said, testing::HasSubstr(fmt::format("lcm.lcm.TCPService {})", port)));
  EXPECT_EQ(std::count(said.begin(), said.end(), '\n'), 1);
  StartRelay();
  testing::internal::CaptureStderr();
  EXPECT_TRUE(Passes());
  EXPECT_THAT(testing::internal::GetCapturedStderr(),
              testing::HasSubstr(url + ": the relay is there\n"));
  relay.reset();
  const std::string after = SaidMeanwhile(&to, 3);
  EXPECT_THAT(after, testing::StartsWith(url + ": the relay is gone ("));
  EXPECT_EQ(std::count(after.begin(), after.end(), '\n'), 1);
}

TEST(TcpqUrl, AnAddressThatMakesNoSenseIsAnError) {
  EXPECT_THROW(LcmBus("tcpq://127.0.0.1:port"), std::runtime_error);
}

// The server at the address need not be a relay.
TEST(TcpqUrl, WhatIsNoRelayIsLeft) {
  const int fd = socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof(address);
  ASSERT_EQ(bind(fd, reinterpret_cast<sockaddr*>(&address), sizeof(address)), 0);
  ASSERT_EQ(listen(fd, 5), 0);
  getsockname(fd, reinterpret_cast<sockaddr*>(&address), &size);
  LcmBus bus(fmt::format("tcpq://127.0.0.1:{}", ntohs(address.sin_port)));
  std::string said = SaidMeanwhile(&bus, 0.05);
  for (int i = 0; i < 5; ++i) {
    const int client = accept(fd, nullptr, nullptr);
    ASSERT_EQ(send(client, "220 mail at your service", 24, MSG_NOSIGNAL), 24);
    said += SaidMeanwhile(&bus, 0.1);
    EXPECT_TRUE(bus.fd() == -1 || i > 0) << "later it may have tried again already";
    close(client);
    said += SaidMeanwhile(&bus, 0.5);
  }
  EXPECT_THAT(said, testing::HasSubstr("no relay there (what answers there is no LCM relay)"));
  EXPECT_EQ(std::count(said.begin(), said.end(), '\n'), 1) << said;
  close(fd);
}

}  // namespace
}  // namespace pangea
