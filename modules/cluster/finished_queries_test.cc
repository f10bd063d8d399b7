#include "cluster/finished_queries.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace pangea {
namespace {

using testing::ElementsAre;

const MapId kMapA{1, 1000};
const MapId kMapB{2, 2000};

std::vector<KeyframeId> Unfinished(std::vector<KeyframeId> pending, FinishedQueries* finished) {
  finished->RemoveFrom(pending.front().map, &pending);
  return pending;
}

TEST(FinishedQueries, AreNotPending) {
  FinishedQueries finished;
  finished.Add({kMapA, 1});
  finished.Add({kMapB, 2});
  for (int repeat = 0; repeat < 2; ++repeat) {
    EXPECT_THAT(Unfinished({{kMapA, 1}, {kMapA, 2}}, &finished), ElementsAre(KeyframeId{kMapA, 2}));
    EXPECT_THAT(Unfinished({{kMapB, 1}, {kMapB, 2}}, &finished), ElementsAre(KeyframeId{kMapB, 1}));
  }
}

TEST(FinishedQueries, AreForgottenWhenTheirMatchHasLeftTheQueue) {
  FinishedQueries finished;
  for (int32_t seq = 0; seq < 100; ++seq) {
    finished.Add({kMapA, seq});
    finished.Add({kMapB, seq});
  }
  EXPECT_THAT(Unfinished({{kMapA, 100}, {kMapA, 7}}, &finished),
              ElementsAre(KeyframeId{kMapA, 100}));
  EXPECT_EQ(finished.size(), 101u) << "nothing is known of the other map";
}

TEST(FinishedQueries, AreBounded) {
  FinishedQueries finished;
  const auto most = static_cast<int32_t>(FinishedQueries::kMaxQueries);
  for (int32_t seq = 0; seq < most + 5; ++seq) {
    finished.Add({kMapA, seq});
  }
  EXPECT_EQ(finished.size(), FinishedQueries::kMaxQueries);
  EXPECT_THAT(Unfinished({{kMapA, 4}, {kMapA, 5}, {kMapA, most + 4}}, &finished),
              ElementsAre(KeyframeId{kMapA, 4}));
}

}  // namespace
}  // namespace pangea
