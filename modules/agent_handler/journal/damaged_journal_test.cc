// A handler that starts on a damaged journal gets back what others still have.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <numeric>

#include "agent_handler/link_test_world.h"
#include "messages/encoding.h"
#include "messages/testing/test_keyframes.h"
#include "pangea/have_t.hpp"
#include "pangea/resend_request_t.hpp"
#include "pangea/status_t.hpp"
#include "pangea/verdict_request_t.hpp"

namespace pangea {
namespace {

class DamagedJournal : public LinkWorld {
 protected:
  void SetUp() override {
    LinkWorld::SetUp();
    server_bus.Subscribe("HAVE", [this](const std::string&, Bytes data) {
      ASSERT_TRUE(DecodeMessage(data, &have));
    });
    server_bus.Subscribe("STATUS_agent_handler", [this](const std::string&, Bytes data) {
      ASSERT_TRUE(DecodeMessage(data, &status));
    });
  }
  using Events = std::vector<std::vector<uint8_t>>;
  // The journal's events on one channel, in the journal's order.
  Events Journalled(const std::string& of) const {
    Events events;
    const Journal journal(journal_path,
                          [&](const std::string& channel, Bytes data, const JournalPlace&) {
                            if (channel == of) {
                              events.emplace_back(data.begin(), data.end());
                            }
                            return true;
                          });
    EXPECT_EQ(journal.mend().copy, "");
    return events;
  }
  // A bit of these events, by their place among those of the channel.
  void Damage(const std::string& of, const std::vector<int>& which) const {
    std::vector<int64_t> offsets;
    const Journal journal(journal_path,
                          [&](const std::string& channel, Bytes, const JournalPlace& place) {
                            if (channel == of) {
                              offsets.push_back(place.offset);
                            }
                            return true;
                          });
    std::fstream file(journal_path, std::ios::in | std::ios::out | std::ios::binary);
    for (const int i : which) {
      file.seekg(offsets.at(static_cast<size_t>(i)) + 60);
      const auto byte = static_cast<char>(file.get() ^ 1);
      file.seekp(offsets.at(static_cast<size_t>(i)) + 60);
      file.put(byte);
    }
  }
  static Events Encoded(const std::vector<int32_t>& seqs) {
    Events events;
    for (const int32_t seq : seqs) {
      events.push_back(EncodeTestKeyframe({kMap, seq}));
    }
    return events;
  }

  have_t have{};
  status_t status{};
};

TEST_F(DamagedJournal, LostKeyframesAreFetchedFromTheOdometry) {
  PublishKeyframes(40);
  Run(10);
  KillHandler();
  Damage("KEYFRAME_1", {10, 11, 25});
  delivered.clear();
  StartHandler();
  Run(3);
  EXPECT_EQ(delivered, Encoded({10, 11, 25}));
  EXPECT_GT(CounterOf(status, "journal_bytes_damaged").value_or(0), 3 * 20'000);
  EXPECT_THAT(status.summary, testing::HasSubstr("THE JOURNAL WAS DAMAGED"));
  EXPECT_EQ(have.num_gaps, 0);
  PublishKeyframes(5);
  Run(3);
  EXPECT_EQ(acknowledged, 44);
  KillHandler();
  std::vector<int32_t> all(45);
  std::iota(all.begin(), all.end(), 0);
  EXPECT_THAT(Journalled("KEYFRAME_1"), testing::UnorderedElementsAreArray(Encoded(all)));
}

TEST_F(DamagedJournal, ANewUplinkFetchesLostKeyframes) {
  PublishKeyframes(40);
  Run(10);
  KillHandler();
  KillUplink();
  Damage("KEYFRAME_1", {10, 25});
  delivered.clear();
  StartHandler();
  StartUplink();
  Run(20);
  EXPECT_EQ(delivered, Encoded({10, 25}));
}

// The odometry has the newest 200; what is older is lost, and said so once it cannot come any more.
TEST_F(DamagedJournal, LostKeyframesThatTheOdometryNoLongerHasAreGivenUp) {
  PublishKeyframes(40);
  Run(10);
  KillHandler();
  Damage("KEYFRAME_1", {10, 25, 30});
  delivered.clear();
  oldest_kept = 20;
  StartHandler();
  Run(15);
  EXPECT_EQ(delivered, Encoded({25, 30}));
  EXPECT_EQ(have.num_gaps, 0) << "for half a minute it may come";
  EXPECT_EQ(CounterOf(status, "keyframes_given_up").value_or(-1), 1);
  Run(20);
  ASSERT_EQ(have.num_gaps, 1);
  EXPECT_EQ(have.gaps[0].from_seq, 10);
  EXPECT_EQ(have.gaps[0].to_seq, 10);
  PublishKeyframes(1);
  Run(3);
  EXPECT_EQ(acknowledged, 40);
  // The next start finds nothing, and asks for nothing.
  KillHandler();
  delivered.clear();
  StartHandler();
  Run(3);
  EXPECT_EQ(have.num_gaps, 1);
  EXPECT_THAT(delivered, testing::IsEmpty());
}

TEST_F(DamagedJournal, MatchesAndConstraintsAreAskedFor) {
  PublishKeyframes(4);
  Run(3);
  for (const int seq : {0, 1, 2, 3}) {
    PlaceMatch match;
    match.query = {kMap, seq};
    if (seq == 3) {
      match.candidates = {{{kMap, 0}, PlaceKind::kIntra, 1.0f, {}}};
    }
    PublishMessage(server_bus, "PLACE_MATCH", ToMessage(match));
  }
  Constraint result;
  result.from = {kMap, 0};
  result.to = {kMap, 3};
  result.kind = PlaceKind::kIntra;
  PublishMessage(server_bus, "CONSTRAINT", ToMessage(result));
  Run(3);
  KillHandler();
  Damage("PLACE_MATCH", {1});
  Damage("CONSTRAINT", {0});
  std::vector<int32_t> matches_asked;
  server_bus.Subscribe("RESEND_REQUEST", [&](const std::string&, Bytes data) {
    resend_request_t request{};
    ASSERT_TRUE(DecodeMessage(data, &request));
    if (request.channel == "PLACE_MATCH") {
      matches_asked.push_back(request.from_seq);
    }
  });
  std::vector<verdict_request_t> results_requested;
  server_bus.Subscribe("VERDICT_REQUEST", [&](const std::string&, Bytes data) {
    ASSERT_TRUE(DecodeMessage(data, &results_requested.emplace_back()));
  });
  StartHandler();
  Run(8);
  EXPECT_THAT(matches_asked, testing::Contains(1));
  EXPECT_THAT(matches_asked, testing::Each(1));
  ASSERT_FALSE(results_requested.empty());
  EXPECT_THAT(results_requested[0].seq, testing::ElementsAre(3));
}

}  // namespace
}  // namespace pangea
