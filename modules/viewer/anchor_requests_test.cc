#include "viewer/anchor_requests.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace pangea::viewer {
namespace {

using testing::IsEmpty;
using testing::SizeIs;

constexpr int64_t kSecond = 1'000'000;

AnchorEdit EditWith(int64_t n, int64_t revision) {
  AnchorEdit edit;
  edit.anchor = {0, n};
  edit.revision = revision;
  return edit;
}

TEST(AnchorRequests, EachIsSaidOnceASecondUntilItIsHeard) {
  AnchorRequests requests;
  EXPECT_TRUE(requests.Add(EditWith(1, 1), 0));
  EXPECT_THAT(requests.Due(0), SizeIs(1));
  EXPECT_THAT(requests.Due(kSecond - 1), IsEmpty());
  EXPECT_THAT(requests.Due(kSecond), SizeIs(1));
  requests.Heard({0, 2}, 1);
  EXPECT_THAT(requests.Due(2 * kSecond), SizeIs(1)) << "that was another one";
  requests.Heard({0, 1}, 1);
  EXPECT_THAT(requests.Due(3 * kSecond), IsEmpty());
}

TEST(AnchorRequests, AreGivenUpAndNamedOnce) {
  AnchorRequests requests;
  requests.Add(EditWith(1, 1), 5);
  EXPECT_THAT(requests.TakeGivenUp(5 + AnchorRequests::kPatience_us - 1), IsEmpty());
  EXPECT_THAT(requests.TakeGivenUp(5 + AnchorRequests::kPatience_us), SizeIs(1));
  EXPECT_THAT(requests.TakeGivenUp(5 + AnchorRequests::kPatience_us), IsEmpty());
  EXPECT_THAT(requests.Due(100 * kSecond), IsEmpty());
}

// If a user drags an anchor twice within a second, the second place counts.
TEST(AnchorRequests, TheNextEditOfAnAnchorTakesThePlace) {
  AnchorRequests requests;
  requests.Add(EditWith(1, 4), 0);
  requests.Add(EditWith(1, 4), 1);
  const std::vector<AnchorEdit> due = requests.Due(1);
  ASSERT_THAT(due, SizeIs(1));
  EXPECT_EQ(due[0].revision, 5);
  requests.Heard({0, 1}, 4);
  EXPECT_EQ(requests.size(), 1U);
  requests.Heard({0, 1}, 6);
  EXPECT_EQ(requests.size(), 0U);
}

TEST(AnchorRequests, AreBounded) {
  AnchorRequests requests;
  for (int64_t n = 0; n < static_cast<int64_t>(AnchorRequests::kMaxPending); ++n) {
    EXPECT_TRUE(requests.Add(EditWith(n, 1), 0));
  }
  EXPECT_FALSE(requests.Add(EditWith(1000, 1), 0));
  EXPECT_TRUE(requests.Add(EditWith(7, 1), 0)) << "one of those that wait";
  EXPECT_EQ(requests.size(), AnchorRequests::kMaxPending);
}

}  // namespace
}  // namespace pangea::viewer
