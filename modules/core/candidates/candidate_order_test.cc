#include "core/candidates/candidate_order.h"

#include <gtest/gtest.h>

namespace pangea {
namespace {

const MapId kMapA{1, 1'000'000};
const MapId kMapB{2, 2'000'000};

TEST(CandidateOrder, ACandidateRestsOnThoseBeforeItsQueryAndItsMatch) {
  EXPECT_TRUE(RestsOn({kMapA, 10}, {kMapB, 5}, {kMapA, 9}));
  EXPECT_FALSE(RestsOn({kMapA, 10}, {kMapB, 5}, {kMapA, 10})) << "not on others of its own query";
  EXPECT_TRUE(RestsOn({kMapA, 10}, {kMapB, 5}, {kMapB, 4}));
  EXPECT_FALSE(RestsOn({kMapA, 10}, {kMapB, 5}, {kMapB, 5})) << "its match may still be on its way";
  EXPECT_FALSE(RestsOn({kMapA, 10}, {kMapA, 5}, {kMapB, 0})) << "another map";
}

TEST(CandidateOrder, TheFirstPendingQueryOfAMapDecides) {
  PendingQueries pending;
  EXPECT_FALSE(pending.Precede({kMapA, 10}, {kMapB, 5}));
  pending.Add({kMapA, 12});
  pending.Add({kMapB, 5});
  EXPECT_FALSE(pending.Precede({kMapA, 12}, {kMapB, 5}));
  EXPECT_TRUE(pending.Precede({kMapA, 13}, {kMapB, 5}));
  EXPECT_TRUE(pending.Precede({kMapA, 12}, {kMapB, 6}));
  pending.Add({kMapA, 14});
  EXPECT_TRUE(pending.Precede({kMapA, 13}, {kMapB, 5})) << "12 is still pending";
}

}  // namespace
}  // namespace pangea
