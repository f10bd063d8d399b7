// As many agents as one handler takes, and one more.

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <map>
#include <set>
#include <stdexcept>

#include "agent_handler/link_test_world.h"
#include "link/agent_key.h"
#include "messages/channels.h"
#include "messages/encoding.h"
#include "messages/testing/test_keyframes.h"
#include "pangea/status_t.hpp"

namespace pangea {
namespace {

using testing::HasSubstr;

constexpr auto kMost = static_cast<int32_t>(AgentHandlerProcess::kMaxAgents);

// An uplink's end of a link bus: what goes down to it is found by its channel's name, so that a
// thousand of them cost a packet no more than one.
class UplinkEnd : public Bus {
 public:
  UplinkEnd(Bus& bus, std::map<std::string, Handler>& downs) : bus_(bus), downs_(downs) {}
  void Publish(const std::string& channel, Bytes data) override { bus_.Publish(channel, data); }
  void Subscribe(const std::string& channel, Handler handler) override {
    downs_[channel] = std::move(handler);
  }

 private:
  Bus& bus_;
  std::map<std::string, Handler>& downs_;
};

// Without LinkWorld's own uplink and handler: one of each agent instead.
class ManyAgents : public LinkWorld {
 protected:
  void SetUp() override {
    LinkWorld::SetUp();
    KillUplink();
    KillHandler();
    for (int32_t id = 2; id <= kMost; ++id) {
      MakeKeyFile(KeyFile(id), id);
    }
    link_bus.Subscribe("LINK_DOWN_.*", [this](const std::string& channel, Bytes data) {
      downs.at(channel)(channel, data);
    });
  }

  void StartUplinks() {
    for (int32_t id = 1; id <= kMost; ++id) {
      agent_buses.push_back(std::make_unique<LocalBus>());
      uplinks.push_back(std::make_unique<UplinkProcess>(*agent_buses.back(), uplink_end, id,
                                                        ReadKeyFileOf(KeyFile(id), id), options));
    }
  }

  void RunAll(double seconds) {
    for (const int64_t end = now + static_cast<int64_t>(seconds * 1e6); now < end; now += 10'000) {
      for (size_t i = 0; i < uplinks.size(); ++i) {
        agent_buses[i]->Drain();
        uplinks[i]->Poll(now);
      }
      link_bus.inner.Drain();
      handler->Poll(now);
      handler->Tick(kWall + now);
      link_bus.inner.Drain();
      server_bus.Drain();
    }
  }

  std::map<std::string, Bus::Handler> downs;
  UplinkEnd uplink_end{link_bus, downs};
  std::vector<std::unique_ptr<LocalBus>> agent_buses;
  std::vector<std::unique_ptr<UplinkProcess>> uplinks;
};

TEST_F(ManyAgents, AThousandAgentsAreServed) {
  std::set<std::string> came;
  status_t status;
  server_bus.Subscribe("KEYFRAME_.*",
                       [&](const std::string& channel, Bytes) { came.insert(channel); });
  server_bus.Subscribe("STATUS_agent_handler", [&](const std::string&, Bytes data) {
    EXPECT_TRUE(DecodeMessage(data, &status));
  });
  StartHandler();
  StartUplinks();
  for (int32_t id = 1; id <= kMost; ++id) {
    agent_buses[static_cast<size_t>(id - 1)]->Publish(channels::Keyframe(id),
                                                      EncodeTestKeyframe({{id, 1000}, 0}));
  }
  RunAll(6);
  EXPECT_EQ(came.size(), AgentHandlerProcess::kMaxAgents);
  EXPECT_EQ(CounterOf(status, "agents"), kMost);
  EXPECT_EQ(CounterOf(status, fmt::format("keyframes_{}", kMost)), 1);
}

TEST_F(ManyAgents, AFolderWithMoreKeysIsRefused) {
  MakeKeyFile(KeyFile(kMost + 1), kMost + 1);
  EXPECT_THAT([this] { StartHandler(); },
              testing::ThrowsMessage<std::runtime_error>(
                  testing::AllOf(HasSubstr((folder / "keys").string() + ": it has 1001"),
                                 HasSubstr("takes 1000 agents at most"))));
}

}  // namespace
}  // namespace pangea
