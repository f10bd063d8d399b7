// Both roles of the bridge against a real nats-server.

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <fstream>
#include <functional>
#include <thread>

#include "bus/wall_clock.h"
#include "cluster/bridge_test_world.h"

namespace pangea {
namespace {

using testing::Each;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Pair;
using testing::SizeIs;

int CountOf(SiteStreams::Reader reader) {
  int count = 0;
  for (; reader.Next(); ++count) {
  }
  return count;
}

class Bridge : public ClusterTest {
 protected:
  Bridge() : ClusterTest("bridge") {}

  TestWorker& AddWorker() {
    workers_.push_back(std::make_unique<TestWorker>(nats_->access()));
    return *workers_.back();
  }
  void AddKeyframes(int count, int candidates) {
    for (int i = 0; i < count; ++i) {
      server_->Add(candidates);
    }
    server_->SayHave();
  }
  // Rounds of 20 ms until it is so; false after `timeout_s`.
  bool Until(const std::function<bool()>& holds, double timeout_s = 15) {
    const int64_t end = WallUtime() + static_cast<int64_t>(1e6 * timeout_s);
    while (!holds()) {
      if (WallUtime() > end) {
        return false;
      }
      Round();
    }
    return true;
  }
  void Round() {
    const int64_t now = WallUtime() + ahead_us_;
    server_->Round(now);
    for (const auto& worker : workers_) {
      worker->Round(now);
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  bool QueueIsEmpty() {
    const auto queue = server_->streams().MatchQueueState();
    return queue && queue->waiting == 0 && queue->unacknowledged == 0;
  }
  void ExpectEachResultOnce() {
    EXPECT_EQ(server_->published().size(), server_->candidates().size());
    EXPECT_THAT(server_->published(), Each(Pair(testing::_, 1)));
    for (const int64_t id : server_->candidates()) {
      EXPECT_TRUE(server_->published().contains(id));
    }
  }

  std::vector<std::unique_ptr<TestWorker>> workers_;
  int64_t ahead_us_ = 0;  // of the bridges' clock
};

TEST_F(Bridge, TwoWorkersShareTheMatchesAndOneIsKilled) {
  server_->set_num_maps(6);
  TestWorker& first = AddWorker();
  TestWorker& second = AddWorker();
  AddKeyframes(30, 3);
  ASSERT_TRUE(Until([&] { return first.num_verified() >= 13 && second.num_verified() >= 12; }));
  EXPECT_FALSE(server_->has_all());
  ASSERT_GT(first.num_waiting(), 0u) << "it has nothing to lose";
  first.Kill();
  ASSERT_TRUE(Until([&] { return server_->has_all(); }));
  EXPECT_TRUE(Until([&] { return QueueIsEmpty(); }, 2));
  ExpectEachResultOnce();
  EXPECT_THAT(second.keyframes(), SizeIs(30));
  EXPECT_GE(first.num_verified() + second.num_verified(), 90);
  EXPECT_LE(first.num_verified() + second.num_verified(), 91)
      << "what was stored is not made again";
  EXPECT_GE(second.results_of_others().size(), 12u) << "it knows what the map has";
}

// So the redundant ones are the same however many workers there are.
TEST_F(Bridge, AMatchWaitsForTheResultsThatItRestsOn) {
  TestWorker& first = AddWorker();
  first.set_pauses(true);
  AddKeyframes(8, 2);
  ASSERT_TRUE(Until([&] { return first.num_waiting() > 0; }));
  TestWorker& second = AddWorker();
  EXPECT_FALSE(Until([&] { return second.num_waiting() > 0; }, 1));
  EXPECT_EQ(first.num_waiting(), 2u) << "it takes four that do not rest on each other";
  first.set_pauses(false);
  ASSERT_TRUE(Until([&] { return first.num_verified() >= 6; }));
  first.Kill();
  ASSERT_TRUE(Until([&] { return server_->has_all(); }));
  EXPECT_GE(second.known_at().size(), 3u);
  for (const auto& [query, known] : second.known_at()) {
    EXPECT_GE(known, 2u * static_cast<size_t>(query.seq)) << "it was taken too early";
  }
  ExpectEachResultOnce();
}

TEST_F(Bridge, ABacklogWaitsForNoResults) {
  TestWorker& first = AddWorker();
  first.set_pauses(true);
  AddKeyframes(8, 2);  // the first may take four
  ASSERT_TRUE(Until([&] { return first.num_waiting() > 0; }));
  AddWorker();
  ahead_us_ += 20'000'000;
  EXPECT_TRUE(Until([&] { return workers_.back()->num_verified() > 0; }));
}

TEST_F(Bridge, AWorkerThatEndsGivesItsMatchesBackAtOnce) {
  AddKeyframes(4, 3);
  ASSERT_TRUE(Until([&] {
    const auto queue = server_->streams().MatchQueueState();
    return queue && queue->waiting == 4;
  }));
  TestWorker& first = AddWorker();
  ASSERT_TRUE(Until([&] { return first.num_verified() >= 1; }));
  workers_.clear();
  AddWorker();
  ASSERT_TRUE(Until([&] { return server_->has_all(); }, 0.8 * 1e-6 * kTestAckWait_us));
  ExpectEachResultOnce();
}

TEST_F(Bridge, AWorkerAtWorkKeepsItsMatchesHoweverLongItTakes) {
  server_->set_num_maps(6);
  TestWorker& slow = AddWorker();
  slow.set_pauses(true);
  AddKeyframes(4, 2);
  ASSERT_TRUE(Until([&] { return slow.num_waiting() == 8; }));
  TestWorker& second = AddWorker();
  EXPECT_FALSE(Until([&] { return second.num_verified() > 0; }, 1.5 * 1e-6 * kTestAckWait_us));
  slow.set_pauses(false);
  EXPECT_TRUE(Until([&] { return server_->has_all(); }));
  ExpectEachResultOnce();
}

TEST_F(Bridge, AResultThatIsLostOnTheWorkersBusIsAskedFor) {
  TestWorker& worker = AddWorker();
  worker.LoseResults(3);
  AddKeyframes(5, 3);
  ASSERT_TRUE(Until([&] { return worker.num_verified() == 15; }));
  EXPECT_FALSE(server_->has_all());
  ahead_us_ += 5'000'000;
  EXPECT_TRUE(Until([&] { return server_->has_all(); }));
  EXPECT_EQ(worker.num_verified(), 15);
  ExpectEachResultOnce();
}

TEST_F(Bridge, ACoreThatStartsAgainPublishesAndQueuesNothingAnew) {
  AddWorker();
  AddKeyframes(8, 2);
  ASSERT_TRUE(Until([&] { return server_->has_all() && QueueIsEmpty(); }));
  workers_.clear();
  server_->RestartBridge();
  server_->SayHave();
  for (int i = 0; i < 100; ++i) {
    Round();
    ahead_us_ += 100'000;
  }
  EXPECT_TRUE(QueueIsEmpty());
  ExpectEachResultOnce();
  AddKeyframes(1, 2);
  AddWorker();
  EXPECT_TRUE(Until([&] { return server_->has_all(); }));
  ExpectEachResultOnce();
  EXPECT_EQ(CountOf(server_->streams().Keyframes()), 9);
}

// The site was served without workers before, or NATS has lost its disk.
TEST_F(Bridge, WhatTheJournalHasGoesIntoEmptyStreams) {
  AddWorker();
  AddKeyframes(6, 2);
  ASSERT_TRUE(Until([&] { return server_->has_all(); }));
  workers_.clear();
  server_->RestartBridge("hall-2");
  server_->SayHave();
  SiteStreams streams(nats_->access(), "hall-2");
  EXPECT_TRUE(Until([&] { return CountOf(streams.Keyframes()) == 6; }));
  EXPECT_EQ(CountOf(streams.Results()), 12);
  ExpectEachResultOnce();
}

TEST_F(Bridge, AgentHandlerIsAnsweredOutOfTheStream) {
  AddWorker();
  AddKeyframes(3, 2);
  ASSERT_TRUE(Until([&] { return server_->has_all(); }));
  server_->AskForResults(1);
  EXPECT_TRUE(Until([&] { return server_->num_again() > 0; }));
  Round();
  EXPECT_EQ(server_->num_again(), 2);
}

TEST_F(Bridge, VerifiersAreAnsweredForKeyframesAndNotForMatches) {
  TestWorker& worker = AddWorker();
  AddKeyframes(6, 0);
  ASSERT_TRUE(Until([&] { return worker.keyframes().size() == 6; }));
  EXPECT_TRUE(QueueIsEmpty()) << "matches without candidates are no work";
  worker.AskForKeyframes(2, 4);
  EXPECT_TRUE(Until([&] { return worker.retransmitted().size() == 3; }));
  EXPECT_THAT(worker.retransmitted(), ElementsAre(2, 3, 4));
}

TEST_F(Bridge, NatsThatIsKilledAndStartsAgainLosesNothing) {
  server_->set_num_maps(6);
  AddWorker();
  AddKeyframes(10, 3);
  ASSERT_TRUE(Until([&] { return server_->published().size() >= 5; }));
  nats_->Stop();
  AddKeyframes(10, 3);
  for (int i = 0; i < 20; ++i) {
    Round();
  }
  EXPECT_FALSE(server_->has_all());
  nats_->Start();
  EXPECT_TRUE(Until([&] { return server_->has_all(); }));
  ExpectEachResultOnce();
}

// A hundred agents' sites share the NATS servers.
TEST_F(Bridge, AsksNatsSeldomWhileNothingIsStored) {
  AddWorker();
  AddKeyframes(4, 2);
  ASSERT_TRUE(Until([&] { return server_->has_all() && QueueIsEmpty(); }));
  Until([] { return false; }, 0.5);
  NatsClient listener(nats_->access(), "test");
  listener.Listen("$JS.API.>");
  Until([] { return false; }, 2);
  int questions = 0;
  while (listener.NextHeard("$JS.API.>")) {
    ++questions;
  }
  EXPECT_GT(questions, 4) << "what others say may be lost";
  EXPECT_LT(questions, 20);
}

TEST_F(Bridge, SaysWhatIsWrongWithNats) {
  const auto why = [](const NatsAccess& access, const std::string& site) -> std::string {
    try {
      SiteStreams(access, site).Make();
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return "";
  };
  const NatsAccess nobody{"nats://127.0.0.1:1", {}, {}};
  EXPECT_THAT(why(nobody, "hall"), HasSubstr("cannot reach NATS at nats://127.0.0.1:1"));
  EXPECT_THAT(why(nobody, "hall"), HasSubstr("nats-server -a 127.0.0.1 -js -sd"));
  EXPECT_THAT(why(nats_->access(), "the hall"),
              HasSubstr("--site the hall: give a name of letters"));
  EXPECT_THAT(why(nats_->access(), "hall"), IsEmpty());
}

TEST_F(Bridge, TakesNoNatsServerOfSmallMessages) {
  const std::string folder = testing::TempDir() + "/nats_small";
  const int port = FreePort();
  std::ofstream(folder + ".conf") << fmt::format(
      "listen: 127.0.0.1:{}\njetstream {{store_dir: \"{}\"}}\nmax_payload: 100000\n", port, folder);
  const Program server({NatsServerProgram(), "-c", folder + ".conf", "-l", folder + ".log"});
  std::string why;
  for (int i = 0; i < 100 && (why.empty() || why.starts_with("cannot reach")); ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    try {
      NatsClient({fmt::format("nats://127.0.0.1:{}", port), {}, {}}, "test");
    } catch (const std::runtime_error& error) {
      why = error.what();
    }
  }
  EXPECT_THAT(why, HasSubstr("takes messages of 100000 bytes"));
  EXPECT_THAT(why, HasSubstr("raise max_payload"));
}

}  // namespace
}  // namespace pangea
