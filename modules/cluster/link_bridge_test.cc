// Tests edges with a real nats-server: link packets between two link buses, and echoes.

#include "cluster/link_bridge.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <functional>
#include <memory>
#include <thread>

#include "cluster/bridge_test_world.h"

namespace pangea {
namespace {

using Packet = std::vector<uint8_t>;
using Packets = std::vector<std::pair<std::string, Packet>>;

TEST(RecentPackets, KnowsTheNewest) {
  RecentPackets recent;
  const auto packet = [](size_t i) {
    return Packet{static_cast<uint8_t>(i), static_cast<uint8_t>(i >> 8)};
  };
  for (size_t i = 0; i <= RecentPackets::kKept; ++i) {
    EXPECT_TRUE(recent.Add(packet(i)));
  }
  EXPECT_FALSE(recent.Add(packet(1)));
  EXPECT_TRUE(recent.Add(packet(0)));  // forgotten
}

class EdgeTest : public testing::Test {
 protected:
  // One end of a link between hosts, with what others on its link bus hear.
  struct Host {
    Host(const NatsAccess& access, LocalBus& link_bus, LinkBridge::End end)
        : bus(link_bus), nats(access, "test"), bridge(link_bus, nats, "hall", end) {
      bus.Subscribe("LINK_.*", [this](const std::string& channel, Bytes packet) {
        heard.emplace_back(channel, Packet(packet.begin(), packet.end()));
      });
    }
    void Send(const std::string& channel, const Packet& packet) {
      bus.Publish(channel, packet);
      bus.Drain();
    }
    bool Heard(const std::string& channel, const Packet& packet) const {
      return std::ranges::find(heard, std::pair(channel, packet)) != heard.end();
    }
    LocalBus& bus;
    NatsClient nats;
    LinkBridge bridge;
    Packets heard;
  };

  void SetUp() override {
    if (NatsServerProgram().empty()) {
      GTEST_SKIP() << "nats-server is not installed: scripts/setup scripts/packages_cluster.txt";
    }
    const std::string files = testing::TempDir() + "/cluster_edge";
    std::filesystem::remove_all(files);
    nats_ = std::make_unique<NatsServer>(files);
    server_ = std::make_unique<Host>(nats_->access(), server_bus_, LinkBridge::End::kServer);
  }

  // Runs all bridges for a while, or until `holds`.
  bool Run(std::initializer_list<Host*> hosts, const std::function<bool()>& holds) {
    for (int i = 0; i < 400 && !holds(); ++i, now_utime_ += 10'000) {
      for (Host* host : hosts) {
        host->bridge.BetweenMessages(now_utime_);
        host->bus.Drain();
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    return holds();
  }

  std::unique_ptr<NatsServer> nats_;
  LocalBus server_bus_;
  std::unique_ptr<Host> server_;
  int64_t now_utime_ = 1'000'000'000'000'000;
};

TEST_F(EdgeTest, AnAgentMayChangeItsEdge) {
  LocalBus bus_a, bus_b;
  Host a(nats_->access(), bus_a, LinkBridge::End::kEdge);
  Host b(nats_->access(), bus_b, LinkBridge::End::kEdge);
  Run({&a, &b, server_.get()}, [] { return false; });  // until NATS knows who listens
  server_->Send("LINK_DOWN_7", {1});
  a.Send("LINK_UP_7", {2});
  EXPECT_TRUE(Run({&a, server_.get()}, [&] { return server_->Heard("LINK_UP_7", {2}); }));
  server_->Send("LINK_DOWN_7", {3});
  EXPECT_TRUE(Run({&a, server_.get()}, [&] { return a.Heard("LINK_DOWN_7", {3}); }));
  // Before its first packet came by an edge, the agent was none of theirs.
  EXPECT_FALSE(a.Heard("LINK_DOWN_7", {1}));
  b.Send("LINK_UP_7", {4});
  EXPECT_TRUE(Run({&b, server_.get()}, [&] { return server_->Heard("LINK_UP_7", {4}); }));
  server_->Send("LINK_DOWN_7", {5});
  EXPECT_TRUE(Run({&b, server_.get()}, [&] { return b.Heard("LINK_DOWN_7", {5}); }));
}

TEST_F(EdgeTest, PacketsAreForwardedOnceOnACommonLinkBus) {
  Host edge(nats_->access(), server_bus_, LinkBridge::End::kEdge);
  Run({&edge, server_.get()}, [] { return false; });
  edge.Send("LINK_UP_7", {1});
  EXPECT_TRUE(Run({&edge, server_.get()}, [&] { return edge.bridge.counters().echoes > 0; }));
  Run({&edge, server_.get()}, [] { return false; });
  EXPECT_EQ(edge.bridge.counters().from_bus, 1);
  EXPECT_EQ(server_->bridge.counters().from_nats, 1);
}

TEST_F(EdgeTest, OnlyPacketsOfTheLinkAreForwarded) {
  LocalBus bus;
  Host edge(nats_->access(), bus, LinkBridge::End::kEdge);
  edge.Send("LINK_UP_123456", {1});
  edge.Send("LINK_UP_x", {1});
  edge.Send("LINK_DOWN_7", {1});
  edge.Send("LINK_UP_7", Packet(40'001));
  EXPECT_EQ(edge.bridge.counters().from_bus, 0);
}

}  // namespace
}  // namespace pangea
