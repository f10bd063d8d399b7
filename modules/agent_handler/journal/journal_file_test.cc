// The journal's file beside its owner: what a follower takes from it is what it would have been
// sent. The journal is a recorded one, of a version that knew nothing of such followers.
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <memory>
#include <set>
#include <string>

#include "agent_handler/agent_handler_process.h"
#include "journal_follower/journal_follower.h"
#include "messages/channels.h"

namespace pangea {
namespace {

using Which = JournalFollower::Which;
constexpr int64_t kWall = 1'700'000'000'000'000;
constexpr int64_t kStep_us = 20'000;

// A bus to another host, where the journal file's name is of no use.
class FarBus : public Bus {
 public:
  explicit FarBus(Bus& bus) : bus_(bus) {}
  void Publish(const std::string& channel, Bytes data) override { bus_.Publish(channel, data); }
  void Subscribe(const std::string& channel_regex, Handler handler) override {
    if (channel_regex != channels::kJournalFile) {
      bus_.Subscribe(channel_regex, std::move(handler));
    }
  }

 private:
  Bus& bus_;
};

// All that a follower was handed, by name.
struct Follower {
  Follower(Bus& bus, const std::string& name)
      : node(bus, name),
        journal(node, {.in_order = true, .matches = Which::kAll, .results = Which::kAll},
                {.keyframe = [this](const Keyframe& k) { Take("k " + ToString(k.id)); },
                 .match =
                     [this](const PlaceMatch& m) {
                       Take("m " + ToString(m.query));
                       return true;
                     },
                 .result = [this](const Constraint& r) { Take("r " + std::to_string(r.Id())); }}) {}
  void Take(const std::string& what) {
    taken.insert(what);
    ++num_taken;
  }
  int64_t resends_asked() const { return node.Status(0, 0, "").resends_asked; }

  Node node;
  std::set<std::string> taken;
  size_t num_taken = 0;
  JournalFollower journal;
};

class JournalFileTest : public testing::Test {
 protected:
  void SetUp() override {
    folder = testing::TempDir() + "/journal_file_" + std::to_string(getpid());
    std::filesystem::create_directories(folder + "/keys");
    std::filesystem::permissions(folder + "/keys", std::filesystem::perms::owner_all);
    std::filesystem::copy_file(PANGEA_SOURCE_DIR "/logs/two_walks/session.lcm",
                               folder + "/journal.lcm");
  }
  void TearDown() override { std::filesystem::remove_all(folder); }

  std::unique_ptr<AgentHandlerProcess> StartHandler() {
    return std::make_unique<AgentHandlerProcess>(link_bus, bus, folder + "/journal.lcm",
                                                 folder + "/keys", kWall, AgentHandlerOptions{});
  }
  void Run(AgentHandlerProcess* handler, const std::vector<Follower*>& followers, double seconds) {
    for (const int64_t end = now + static_cast<int64_t>(1e6 * seconds); now < end;
         now += kStep_us) {
      handler->Poll(now);
      handler->Tick(kWall + now);
      bus.Drain();
      for (Follower* const follower : followers) {
        follower->journal.Tick(kWall + now);
      }
    }
  }

  std::string folder;
  LocalBus link_bus, bus;
  int64_t now = kStep_us;
};

TEST_F(JournalFileTest, AFollowerOnTheSameHostHasWhatAFarOneIsSentAndAsksForNothing) {
  FarBus far_bus(bus);
  Follower near(bus, "near"), far(far_bus, "far");
  const auto handler = StartHandler();
  Run(handler.get(), {&near}, 0.1);
  EXPECT_FALSE(near.journal.catching_up()) << "after the first message";
  Run(handler.get(), {&near, &far}, 20);
  EXPECT_FALSE(far.journal.catching_up());
  EXPECT_GT(near.taken.size(), 2 * 63u);
  EXPECT_EQ(near.taken, far.taken);
  EXPECT_EQ(near.num_taken, near.taken.size()) << "once, though the file is told of each second";
  EXPECT_EQ(near.resends_asked(), 0);
  EXPECT_GT(far.resends_asked(), 0);
}

TEST_F(JournalFileTest, AnotherServerOnTheBusIsTold) {
  std::string refused;
  bus.Subscribe("STATUS_agent_handler", [&](const std::string&, Bytes data) {
    status_t status{};
    ASSERT_GE(status.decode(data.data(), 0, static_cast<int>(data.size())), 0);
    for (const counter_t& reason : status.refused) {
      refused += reason.name + "\n";
    }
  });
  const auto handler = StartHandler();
  Run(handler.get(), {}, 3);
  EXPECT_EQ(refused, "") << "its own journal";
  PublishMessage(bus, std::string(channels::kJournalFile),
                 ToMessage(JournalFile{"/elsewhere/journal.lcm", {}}));
  Run(handler.get(), {}, 3);
  EXPECT_NE(refused.find("another server is on this bus, with the journal /elsewhere/journal.lcm"),
            std::string::npos)
      << refused;
}

}  // namespace
}  // namespace pangea
