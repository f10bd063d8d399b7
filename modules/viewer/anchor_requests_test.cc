#include "viewer/anchor_requests.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <string>

#include "viewer/viewer_test_world.h"

namespace pangea::viewer {
namespace {

using testing::IsEmpty;
using testing::SizeIs;

AnchorEdit EditWith(int64_t n, int64_t revision) {
  AnchorEdit edit;
  edit.anchor = {0, n};
  edit.revision = revision;
  return edit;
}

TEST(AnchorRequests, EachIsSaidOnceASecondUntilItIsJournalled) {
  AnchorRequests requests;
  EXPECT_TRUE(requests.Add(EditWith(1, 1), 0));
  EXPECT_THAT(requests.Due(0), SizeIs(1));
  EXPECT_THAT(requests.Due(kSecond - 1), IsEmpty());
  EXPECT_THAT(requests.Due(kSecond), SizeIs(1));
  EXPECT_FALSE(requests.TakeLost(EditWith(2, 1)));
  EXPECT_THAT(requests.Due(2 * kSecond), SizeIs(1)) << "that was another one";
  EXPECT_FALSE(requests.TakeLost(EditWith(1, 1)));
  EXPECT_THAT(requests.Due(3 * kSecond), IsEmpty());
  EXPECT_THAT(requests.TakeGivenUp(AnchorRequests::kPatience_us), IsEmpty());
  EXPECT_EQ(requests.size(), 0U);
}

struct Other {
  std::string name;
  std::function<void(AnchorEdit*)> edit;  // makes another editor's edit of ours
  bool loses_move = false, loses_deletion = false;
};

TEST(AnchorRequests, WhatAnotherEditHasOverriddenIsLost) {
  using Placement = AnchorEdit::Placement;
  const std::vector<Other> others = {
      {"another tool, same revision", [](AnchorEdit* e) { e->name = "b"; }, true, true},
      {"another tool elsewhere", [](AnchorEdit* e) { e->T_ref_anchor.t.x() = 9; }, true, true},
      {"an earlier revision", [](AnchorEdit* e) { e->revision = 3; }},
      {"an agent", [](AnchorEdit* e) { e->agent_id = 2; }, true},
      {"a later revision", [](AnchorEdit* e) { e->revision = 5; }, true},
      {"an agent that keeps the place",
       [](AnchorEdit* e) { e->agent_id = 2, e->placement = Placement::kSame; }},
      {"an agent that deleted it before",
       [](AnchorEdit* e) { e->revision = 3, e->agent_id = 2, e->deleted = true; }, true},
  };
  for (const Other& other : others) {
    for (const bool deletes : {false, true}) {
      AnchorEdit ours = EditWith(1, 4);
      ours.placement = Placement::kKeyframe;
      ours.map = {1, 1000};
      AnchorEdit theirs = ours;
      ours.deleted = deletes;
      other.edit(&theirs);
      AnchorRequests requests;
      requests.Add(ours, 0);
      const bool lost = requests.TakeLost(theirs).has_value();
      EXPECT_EQ(lost, deletes ? other.loses_deletion : other.loses_move) << other.name << deletes;
      EXPECT_EQ(requests.Due(0).size(), lost ? 0U : 1U) << other.name << deletes;
      EXPECT_FALSE(requests.TakeLost(theirs)) << "only once";
    }
  }
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
  EXPECT_FALSE(requests.TakeLost(EditWith(1, 4)));
  EXPECT_EQ(requests.size(), 1U);
}

// The anchor is shown up to half a second after the edit was journalled.
TEST(AnchorRequests, TheNextEditHasAHigherRevisionThoughTheFirstIsNotShownYet) {
  AnchorRequests requests;
  requests.Add(EditWith(1, 4), 0);
  requests.TakeLost(EditWith(1, 4));
  requests.Shown({0, 1}, 3);
  requests.Add(EditWith(1, 4), 1);
  EXPECT_EQ(requests.Due(1).at(0).revision, 5);
  requests.Shown({0, 1}, 5);
  EXPECT_EQ(requests.size(), 1U) << "that was another editor's";
  requests.TakeLost(EditWith(1, 5));
  requests.Shown({0, 1}, 5);
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
