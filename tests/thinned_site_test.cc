// Tests a live server on a thinned site: an agent comes and finds the anchor of a visit of which
// few keyframes are left. The test is repeated on the journal that the first server leaves.

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "bus/bus.h"
#include "link/agent_key.h"
#include "log_file/log_writer.h"
#include "messages/anchor_messages.h"
#include "messages/channels.h"
#include "messages/messages.h"
#include "pangea/keyframe_t.hpp"
#include "pangea/resend_request_t.hpp"
#include "pangea/status_t.hpp"
#include "processes/child_process.h"
#include "programs.h"
#include "site/compact.h"
#include "site/site_test_world.h"

namespace pangea::tests {
namespace {

namespace fs = std::filesystem;
constexpr int32_t kAgent = 2;
constexpr int kNumVisits = 4;  // of the second walk, in the journal
constexpr int32_t kSeq = 15;   // of the keyframe at which the anchor is placed

double Now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

class ThinnedSite : public testing::Test {
 protected:
  ThinnedSite() {
    const std::vector<site::StoredEvent> walks = site::WalksAgainAndAgain();
    for (const site::StoredEvent& event : site::WalksOf({kAgent})) {
      keyframe_t keyframe{};
      if (DecodeMessage(event.data, &keyframe)) {
        walk.push_back(keyframe);
      }
    }
    std::vector<site::StoredEvent> events = walks;
    // The keyframe is in the second visit's map, whose views newer visits have too.
    KeyframeId keyframe{*Parse(walk.front().id.map).value, kSeq};
    keyframe.map.opened_utime += 1;
    const Eigen::Vector3d p_body_anchor(2, 0.3, -0.2);
    events.push_back(
        site::PlacementEvent({kAgent, 1'700'000'000'000'000}, 0, keyframe, p_body_anchor));
    // The odometries of all visits have the same numbers.
    p_odom_anchor = *Parse(walk.at(kSeq).T_odom_body).value * p_body_anchor;
    hall = site::MakeSite(folder / "hall", events);
    MakeKeyFile(hall.keys() / KeyFileName(kAgent), kAgent);
    summary = Compact(hall, site::AfterTheLast(walks));
  }

  static std::string Url(int number) {
    // Below the range from which the kernel gives ports to LCM's senders.
    const int port = 20000 + getpid() % 4000 * 3 + number;
    return fmt::format("udpm://239.255.76.67:{}?ttl=0&recv_buf_size=4194304", port);
  }
  static std::string Program(const std::string& name) { return PANGEA_BINARY_DIR "/bin/" + name; }

  // Writes the second walk as a visit that is not in the journal.
  fs::path WriteWalk(int visit) const {
    fs::path file = folder / fmt::format("visit_{}.lcm", visit);
    LogFileWriter log(file.string());
    for (keyframe_t keyframe : walk) {
      keyframe.id.map.opened_utime += visit;
      log.Write(keyframe.utime, channels::Keyframe(kAgent), EncodeMessage(keyframe));
    }
    return file;
  }

  ChildProcess Start(const std::string& program, const std::vector<std::string>& arguments) const {
    std::vector<std::string> argv{Program(program)};
    argv.insert(argv.end(), arguments.begin(), arguments.end());
    return {program, argv, folder / (program + ".txt")};
  }

  static bool Until(double seconds, LcmBus& bus, const std::function<bool()>& done) {
    for (const double end = Now() + seconds; !done() && Now() < end;) {
      bus.Handle(50);
    }
    return done();
  }

  // Starts a server, then the agent, and checks the anchor's position that the agent receives.
  void WalkIn(int visit) {
    LcmBus server_bus(Url(0)), agent_bus(Url(2));
    std::map<std::string, status_t> statuses;
    int requests = 0;
    server_bus.Subscribe("STATUS_.*", [&](const std::string&, Bytes data) {
      status_t status{};
      if (DecodeMessage(data, &status)) {
        statuses[status.process] = status;
      }
    });
    server_bus.Subscribe(std::string(channels::kResendRequest),
                         [&](const std::string&, Bytes data) {
                           resend_request_t request{};
                           const bool decoded = DecodeMessage(data, &request);
                           requests += decoded && request.channel.starts_with("KEYFRAME_") ? 1 : 0;
                         });
    std::optional<AnchorState> heard;
    const int64_t opened_utime = walk.front().id.map.opened_utime + visit;
    agent_bus.Subscribe(channels::Anchor(kAgent), [&](const std::string&, Bytes data) {
      anchor_t message{};
      ASSERT_TRUE(DecodeMessage(data, &message));
      const AnchorState state = *Parse(message).value;
      if (state.map.opened_utime == opened_utime) {
        heard = state;
      }
    });
    ChildProcess server =
        Start("pangea-server", {"--site", hall.folder.string(), "--bus", Url(0), "--link", Url(1)});
    const std::string before = fmt::format("{} maps in 1 groups", NumMaps());
    ASSERT_TRUE(Until(240, server_bus,
                      [&] {
                        return statuses["posegraph"].summary.starts_with(before) &&
                               statuses["anchors"].summary == "1 anchors, 1 of them placed";
                      }))
        << statuses["posegraph"].summary << "; " << statuses["anchors"].summary;
    ChildProcess uplink = Start("pangea-uplink", {"--agent", std::to_string(kAgent), "--key",
                                                  (hall.keys() / KeyFileName(kAgent)).string(),
                                                  "--bus", Url(2), "--link", Url(1)});
    ChildProcess player =
        Start("pangea-keyframe-player", {"--agent", std::to_string(kAgent), "--bus", Url(2),
                                         "--keyframes", WriteWalk(visit).string(), "--rate", "2"});
    EXPECT_TRUE(Until(240, agent_bus, [&] {
      while (server_bus.Handle(0)) {
      }
      return heard && !player.running();
    })) << statuses["posegraph"].summary;
    // Waits for the results of the last keyframes; then no process may request thinned keyframes.
    // On a busy machine, the verifications take minutes.
    Until(4, server_bus, [] { return false; });
    EXPECT_TRUE(Until(240, server_bus, [&] {
      return statuses["fusion"].pending == 0 && statuses["posegraph"].pending == 0;
    })) << statuses["fusion"].summary;
    requests = 0;
    Until(3, server_bus, [] { return false; });
    Until(1, agent_bus, [] { return false; });
    EXPECT_EQ(requests, 0);
    EXPECT_THAT(statuses["posegraph"].summary,
                testing::StartsWith(fmt::format("{} maps in 1 groups", NumMaps())));
    ASSERT_TRUE(heard);
    // The odometry's drift since the placement is a part of this difference.
    EXPECT_LT((heard->T_odom_anchor.t - p_odom_anchor).norm(), 0.1)
        << heard->T_odom_anchor.t.transpose() << " for " << p_odom_anchor.transpose();
    player.Stop(5);
    uplink.Stop(5);
    server.Stop(240);  // it writes checkpoints
  }

  int NumMaps() const {
    std::set<std::pair<int32_t, int64_t>> maps;
    for (const site::StoredEvent& event : site::EventsOf(hall)) {
      keyframe_t keyframe{};
      if (event.channel.starts_with(channels::kKeyframePrefix) &&
          DecodeMessage(event.data, &keyframe)) {
        maps.emplace(keyframe.id.map.agent_id, keyframe.id.map.opened_utime);
      }
    }
    return static_cast<int>(maps.size());
  }

  const fs::path folder = FreshFolder(fmt::format("thinned_site_{}", getpid()));
  std::vector<keyframe_t> walk;
  Eigen::Vector3d p_odom_anchor;
  site::Site hall;
  site::CompactSummary summary;
};

TEST_F(ThinnedSite, AnAgentThatWalksInFindsTheAnchorAndSoDoesTheNext) {
  ASSERT_GT(summary.keyframes_gone, 30);
  ASSERT_GT(summary.constraints_derived, 0);
  WalkIn(kNumVisits);
  ASSERT_TRUE(fs::exists(hall.checkpoints() / "posegraph"));
  WalkIn(kNumVisits + 1);
  for (const auto& log : fs::directory_iterator(hall.folder / "logs")) {
    EXPECT_THAT(ReadFile(log.path()), testing::Not(testing::HasSubstr("is not used")));
  }
  fs::remove_all(folder);
}

}  // namespace
}  // namespace pangea::tests
