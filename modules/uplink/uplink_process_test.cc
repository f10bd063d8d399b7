#include "uplink/uplink_process.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <string>

#include "bus/bus.h"
#include "bus/node.h"
#include "files/testing/full_disk.h"
#include "messages/channels.h"
#include "messages/testing/test_keyframes.h"
#include "pangea/status_t.hpp"

namespace pangea {
namespace {

// The reasons in the uplink's status after a second on a bus of which a server has a process, or
// not.
std::string RefusedBeside(const std::string& process) {
  LocalBus agent_bus, link_bus;
  UplinkProcess uplink(agent_bus, link_bus, 1, SecretKey::Random(), UplinkOptions{});
  Node other(agent_bus, process);
  std::string refused;
  agent_bus.Subscribe(channels::Status("uplink_1"), [&](const std::string&, Bytes data) {
    status_t status{};
    ASSERT_TRUE(DecodeMessage(data, &status));
    for (const counter_t& counter : status.refused) {
      refused += counter.name;
    }
  });
  for (const int64_t utime : {1'000'000, 2'500'000, 4'000'000}) {
    other.Publish(channels::Status(process), status_t{});
    uplink.Poll(utime);
    uplink.Tick(utime);
    agent_bus.Drain();
  }
  return refused;
}

TEST(UplinkProcess, AServerOnTheAgentsBusIsNamed) {
  EXPECT_NE(RefusedBeside("agent_handler").find("--bus"), std::string::npos);
  EXPECT_EQ(RefusedBeside("vio_1"), "");
}

// An answer takes a moment; only its lack is worth a reason.
TEST(UplinkProcess, SaysOnlyAfterSecondsThatNobodyAnswers) {
  LocalBus agent_bus, link_bus;
  UplinkProcess uplink(agent_bus, link_bus, 7, SecretKey::Random(), UplinkOptions{});
  std::string summary;
  agent_bus.Subscribe(channels::Status("uplink_7"), [&](const std::string&, Bytes data) {
    status_t status{};
    ASSERT_TRUE(DecodeMessage(data, &status));
    summary = status.summary;
  });
  const auto summary_at = [&](int64_t seconds) {
    uplink.Poll(100'000'000 + seconds * 1'000'000);
    uplink.Tick(seconds * 1'000'000);
    agent_bus.Drain();
    return summary;
  };
  EXPECT_THAT(summary_at(0), testing::StartsWith("connecting, "));
  EXPECT_THAT(summary_at(4), testing::StartsWith("connecting, "));
  EXPECT_THAT(summary_at(6), testing::StartsWith("no answer yet: the handler is away, or its key "
                                                 "for agent 7 is not ours, "));
}

TEST(UplinkProcess, TellsWhatWasSentAndWhatIsLeft) {
  LocalBus agent_bus, link_bus;
  const std::string folder = testing::TempDir() + "uplink_totals";
  std::filesystem::remove_all(folder);
  Spool spool(folder, 1, 1'000'000);
  UplinkProcess kept(agent_bus, link_bus, 1, SecretKey::Random(), UplinkOptions{}, &spool);
  UplinkProcess lost(agent_bus, link_bus, 1, SecretKey::Random(), UplinkOptions{});
  EXPECT_EQ(kept.Totals(), "0.0 kB sent; keyframes: 0 acknowledged");
  agent_bus.Publish(channels::Keyframe(1), EncodeTestKeyframe({{1, 5}, 0}));
  agent_bus.Drain();
  EXPECT_EQ(kept.Totals(),
            "0.0 kB sent; keyframes: 0 acknowledged, 1 in the spool for the next start");
  EXPECT_EQ(lost.Totals(),
            "0.0 kB sent; keyframes: 0 acknowledged, 1 lost: --spool FOLDER keeps them for the "
            "next start");
}

// Else they would be lost with the uplink, hours after the disk was all right again.
TEST(UplinkProcess, KeyframesThatTheDiskRefusedAreStoredLater) {
  const std::filesystem::path folder =
      std::filesystem::path(testing::TempDir()) / "uplink_process_spool";
  std::filesystem::remove_all(folder);
  const MapId map{1, 1000};
  {
    LocalBus agent_bus, link_bus;
    Spool spool(folder, 1, 1 << 30);
    UplinkProcess uplink(agent_bus, link_bus, 1, SecretKey::Random(), UplinkOptions{}, &spool);
    const auto run = [&](int64_t utime) {
      agent_bus.Drain();
      uplink.Poll(utime);
      uplink.Tick(utime);
    };
    {
      const FullDisk full(1000);
      agent_bus.Publish(channels::Keyframe(1), EncodeTestKeyframe({map, 0}));
      agent_bus.Publish(channels::Keyframe(1), EncodeTestKeyframe({map, 1}));
      run(1'000'000);
      EXPECT_TRUE(spool.Kept().empty());
    }
    run(2'500'000);
  }
  Spool spool(folder, 1, 1 << 30);
  EXPECT_THAT(spool.Kept(), testing::ElementsAre(KeyframeId{map, 0}, KeyframeId{map, 1}));
  EXPECT_EQ(spool.Read({map, 1}), EncodeTestKeyframe({map, 1}));
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace pangea
