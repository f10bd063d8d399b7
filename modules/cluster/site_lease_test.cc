// The lease, when the replica of NATS that answers lags behind the stream's leader, or was its
// leader until the network was cut, and does not know that it is none any more.

#include "cluster/site_lease.h"

#include <gtest/gtest.h>

#include <utility>
#include <vector>

namespace pangea {
namespace {

constexpr int64_t kSecond = 1'000'000;  // microseconds

// The leader has all records, the replica that is asked for a record only the first ones. A former
// leader has only the first ones, and stores nothing.
class LaggingRecords : public LeaseRecords {
 public:
  std::optional<uint64_t> LeaseSequence() override {
    if (no_leader) {
      return std::nullopt;
    }
    return records_.size() - (former_leader ? lag : 0);
  }
  std::optional<NatsClient::Message> FindLease() override {
    const size_t known = records_.size() - lag;
    if (known == 0) {
      return std::nullopt;
    }
    const std::string& record = records_[known - 1];
    return NatsClient::Message{"", known, 0, {record.begin(), record.end()}};
  }
  NatsClient::StoreAnswer StoreLease(const std::string& record, uint64_t behind) override {
    if (former_leader) {
      return {NatsClient::Stored::kUnreachable};
    }
    if (behind != records_.size()) {
      return {NatsClient::Stored::kOtherwise};
    }
    records_.push_back(record);
    return {NatsClient::Stored::kNew, records_.size()};
  }

  size_t lag = 0;  // records
  bool former_leader = false;
  bool no_leader = false;

 private:
  std::vector<std::string> records_;
};

class SiteLeaseTest : public testing::Test {
 protected:
  LaggingRecords records;
  SiteLease first{records, "first"}, second{records, "second"};
};

TEST_F(SiteLeaseTest, AnOldRecordOfNobodyDoesNotMakeItFree) {
  ASSERT_TRUE(first.TryAcquire(kSecond));
  first.Release();
  ASSERT_TRUE(first.TryAcquire(2 * kSecond));
  records.lag = 1;
  EXPECT_FALSE(second.TryAcquire(3 * kSecond));
  records.lag = 0;
  EXPECT_FALSE(second.TryAcquire(3 * kSecond));
  EXPECT_EQ(second.seen_holder(), "first");
  EXPECT_TRUE(first.Renew(3 * kSecond));
}

// Else it would renew the record of the other as its own.
TEST_F(SiteLeaseTest, AnOldRecordOfOursDoesNotHideTheNewHolder) {
  ASSERT_TRUE(first.TryAcquire(kSecond));
  ASSERT_FALSE(second.TryAcquire(kSecond));
  ASSERT_TRUE(second.TryAcquire(kSecond + SiteLease::kHeld_us));
  const int64_t now = 2 * kSecond + SiteLease::kHeld_us;
  records.lag = 1;
  first.Renew(now);
  first.Renew(now + kSecond);
  EXPECT_FALSE(first.fresh(now + kSecond));
  EXPECT_TRUE(second.Renew(now + kSecond));
  records.lag = 0;
  EXPECT_FALSE(first.Renew(now + kSecond));
  EXPECT_EQ(first.seen_holder(), "second");
}

// Seen: a server that was cut off waited 2 s for NATS, and answered agents for 5.4 s.
TEST_F(SiteLeaseTest, WhatCouldNotBeRenewedIsNotFresh) {
  ASSERT_TRUE(first.TryAcquire(kSecond));
  records.former_leader = true;
  EXPECT_TRUE(first.Renew(2 * kSecond));
  EXPECT_FALSE(first.fresh(2 * kSecond));
  records.former_leader = false;
  EXPECT_TRUE(first.Renew(2 * kSecond));
  EXPECT_TRUE(first.fresh(2 * kSecond));
}

// Seen after a cut of 30 s: both hosts gave the site up.
TEST_F(SiteLeaseTest, AFormerLeadersRecordDoesNotTakeItFromItsHolder) {
  ASSERT_TRUE(first.TryAcquire(kSecond));
  ASSERT_FALSE(second.TryAcquire(kSecond));
  const int64_t now = kSecond + SiteLease::kHeld_us;
  ASSERT_TRUE(second.TryAcquire(now));
  records.lag = 1;
  records.former_leader = true;
  EXPECT_TRUE(second.Renew(now + kSecond)) << "nobody has taken it";
  records.former_leader = false;
  EXPECT_TRUE(second.Renew(now + kSecond));
  EXPECT_TRUE(second.fresh(now + kSecond));
}

// From the first look on, NATS chooses a leader for 5 s. Returns after how long `second` has the
// lease; `signs_s`: how long signs of life of `first` come.
double TakenAfter_s(LaggingRecords& records, SiteLease& second, double signs_s) {
  const int64_t begin = 2 * kSecond;
  EXPECT_FALSE(second.TryAcquire(begin));
  for (int64_t at = 0; at < 20 * kSecond; at += kSecond / 10) {
    if (static_cast<double>(at) < signs_s * kSecond) {
      second.NoteSign("first", begin + at);
    }
    records.no_leader = at > 0 && at < 5 * kSecond;
    if (second.TryAcquire(begin + at)) {
      return static_cast<double>(at) / kSecond;
    }
  }
  return 20;
}

TEST_F(SiteLeaseTest, WhoFellSilentBeforeNatsHadALeaderGetsNoMoreTime) {
  ASSERT_TRUE(first.TryAcquire(kSecond));
  EXPECT_NEAR(TakenAfter_s(records, second, 0.5), 5.6, 0.15);
}

TEST_F(SiteLeaseTest, WhoLivesHasTimeToRenewItWhenNatsHasALeader) {
  ASSERT_TRUE(first.TryAcquire(kSecond));
  EXPECT_NEAR(TakenAfter_s(records, second, 20), 9, 0.15);
}

// A bridge of an older version, or users that an older pangea-nats-config made.
TEST_F(SiteLeaseTest, WhoNeverGaveASignHasTimeToRenewItToo) {
  ASSERT_TRUE(first.TryAcquire(kSecond));
  EXPECT_NEAR(TakenAfter_s(records, second, 0), 9, 0.15);
}

}  // namespace
}  // namespace pangea
