#include "core/candidates/candidate_order.h"

#include <gtest/gtest.h>

namespace pangea {
namespace {

const MapId kA{1, 1'000'000};
const MapId kB{2, 2'000'000};

TEST(CandidateOrder, ACandidateRestsOnThoseBeforeItsQueryAndItsMatch) {
  EXPECT_TRUE(RestsOn({kA, 10}, {kB, 5}, {kA, 9}));
  EXPECT_FALSE(RestsOn({kA, 10}, {kB, 5}, {kA, 10})) << "not on others of its own query";
  EXPECT_TRUE(RestsOn({kA, 10}, {kB, 5}, {kB, 4}));
  EXPECT_FALSE(RestsOn({kA, 10}, {kB, 5}, {kB, 5})) << "its match may still be on its way";
  EXPECT_FALSE(RestsOn({kA, 10}, {kA, 5}, {kB, 0})) << "another map";
}

TEST(CandidateOrder, TheFirstPendingQueryOfAMapDecides) {
  PendingQueries pending;
  EXPECT_FALSE(pending.Precede({kA, 10}, {kB, 5}));
  pending.Add({kA, 12});
  pending.Add({kB, 5});
  EXPECT_FALSE(pending.Precede({kA, 12}, {kB, 5}));
  EXPECT_TRUE(pending.Precede({kA, 13}, {kB, 5}));
  EXPECT_TRUE(pending.Precede({kA, 12}, {kB, 6}));
  pending.Add({kA, 14});
  EXPECT_TRUE(pending.Precede({kA, 13}, {kB, 5})) << "12 is still pending";
}

}  // namespace
}  // namespace pangea
