// An odometry goes on and opens new maps while its uplink is away: the next one finds it all.

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <functional>
#include <memory>

#include "agent_handler/link_test_world.h"
#include "bus/retransmission/reliable_keyframe_publisher.h"
#include "messages/testing/test_keyframes.h"

namespace pangea {
namespace {

class MissedMaps : public testing::Test {
 protected:
  MissedMaps() { std::filesystem::remove_all(folder); }
  ~MissedMaps() override { std::filesystem::remove_all(folder); }
  void Publish(int map, int32_t from_seq, int32_t to_seq) {
    for (int32_t seq = from_seq; seq <= to_seq; ++seq) {
      const KeyframeId id{{1, 1000 * map}, seq};
      publisher.Publish(id, EncodeTestKeyframe(id));
      ++published;
    }
    bus.Drain();
  }
  // An uplink that lives so long, and hears what is published at its start; what is in its spool
  // when it is killed.
  size_t LiveUplink(double seconds, const std::function<void()>& publish) {
    buses.push_back(std::make_unique<SwitchedBus>(bus));
    Spool spool(folder, 1, 1 << 30);
    uplinks.push_back(std::make_unique<UplinkProcess>(*buses.back(), link, 1, SecretKey::Random(),
                                                      UplinkOptions{}, &spool));
    publish();
    for (const int64_t end = now + static_cast<int64_t>(1e6 * seconds); now < end; now += 20'000) {
      uplinks.back()->Poll(now);
      bus.Drain();
    }
    buses.back()->Off();
    return spool.Kept().size();
  }

  const std::filesystem::path folder =
      testing::TempDir() + "pangea_missed_" + std::to_string(getpid());
  LocalBus bus, link;
  std::vector<std::unique_ptr<SwitchedBus>> buses;
  std::vector<std::unique_ptr<UplinkProcess>> uplinks;
  Node node{bus, "vio_1"};
  ReliableKeyframePublisher publisher{node, 1, 200, 0};
  size_t published = 0;
  int64_t now = 1'000'000;
};

TEST_F(MissedMaps, AnUplinkThatStartsLateFetchesTheFirstMaps) {
  Publish(1, 0, 39);
  Publish(2, 0, 0);
  Publish(3, 0, 39);
  EXPECT_EQ(LiveUplink(20, [&] { Publish(4, 0, 0); }), published);
}

TEST_F(MissedMaps, AKilledUplinkFetchesTheEndOfOneMapAndAllOfTheNext) {
  EXPECT_EQ(LiveUplink(1, [&] { Publish(1, 0, 22); }), 23u);
  Publish(1, 23, 31);
  Publish(2, 0, 31);
  Publish(3, 0, 31);
  EXPECT_EQ(LiveUplink(20, [&] { Publish(4, 0, 0); }), published);
}

}  // namespace
}  // namespace pangea
