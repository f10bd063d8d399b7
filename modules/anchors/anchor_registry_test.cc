#include "anchors/anchor_registry.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <vector>

namespace pangea {
namespace {

using Placement = AnchorEdit::Placement;

const AnchorId kId{1, 100};

AnchorEdit Edit(int64_t revision, int32_t agent_id, const std::string& name, Placement placement) {
  AnchorEdit edit;
  edit.anchor = kId;
  edit.revision = revision;
  edit.agent_id = agent_id;
  edit.right = AnchorRight::kEditAll;
  edit.name = name;
  edit.placement = placement;
  edit.map = {1, 7};
  edit.keyframe_seq = static_cast<int32_t>(revision);
  return edit;
}

TEST(AnchorRegistry, TheOrderOfArrivalDoesNotMatter) {
  AnchorEdit refused = Edit(9, 3, "no", Placement::kKeyframe);
  refused.right = AnchorRight::kEditOwn;  // the anchor is another agent's
  const std::vector<AnchorEdit> edits = {Edit(1, 1, "made", Placement::kKeyframe),
                                         Edit(2, 2, "moved", Placement::kKeyframe),
                                         Edit(3, 1, "renamed", Placement::kSame),
                                         Edit(3, 2, "renamed at once", Placement::kSame),
                                         Edit(2, 1, "moved too", Placement::kKeyframe),
                                         refused};
  std::vector<size_t> order(edits.size());
  std::iota(order.begin(), order.end(), 0);
  do {
    AnchorRegistry registry(10);
    for (const size_t i : order) {
      registry.Take(edits[i]);
      registry.Take(edits[i]);  // repeats are harmless
    }
    const AnchorEntry& entry = registry.entries().at(kId);
    ASSERT_EQ(entry.name, "renamed at once");
    ASSERT_EQ(entry.revision, 3);
    ASSERT_EQ(entry.edited_by, 2);
    ASSERT_EQ(entry.places.size(), 1u);
    ASSERT_EQ(entry.places.begin()->first, (std::pair<int64_t, int32_t>{2, 2}));
  } while (std::ranges::next_permutation(order).found);
}

TEST(AnchorRegistry, WhatIsDeletedStaysDeleted) {
  AnchorRegistry registry(1);
  EXPECT_EQ(registry.Take(Edit(1, 1, "a", Placement::kKeyframe)), "");
  AnchorEdit deleted = Edit(2, 1, "a", Placement::kSame);
  deleted.deleted = true;
  EXPECT_EQ(registry.Take(deleted), "");
  EXPECT_EQ(registry.Take(Edit(3, 1, "late", Placement::kKeyframe)), "");
  EXPECT_TRUE(registry.entries().at(kId).deleted);
  EXPECT_EQ(registry.num_deleted(), 1u);
}

TEST(AnchorRegistry, RightsOfTheKey) {
  const auto refused = [](AnchorRight right, int32_t editor) {
    AnchorRegistry registry(10);
    AnchorEdit edit = Edit(1, editor, "a", Placement::kKeyframe);
    edit.right = right;
    return !registry.Take(edit).empty();
  };
  EXPECT_FALSE(refused(AnchorRight::kEditAll, 2));
  EXPECT_FALSE(refused(AnchorRight::kEditOwn, 1));
  EXPECT_TRUE(refused(AnchorRight::kEditOwn, 2));
  EXPECT_TRUE(refused(AnchorRight::kRead, 1));
  EXPECT_TRUE(refused(AnchorRight::kUnknown, 1));
}

TEST(AnchorRegistry, IsBoundedByThoseThatAreNotDeleted) {
  AnchorRegistry registry(1);
  EXPECT_EQ(registry.Take(Edit(1, 1, "a", Placement::kKeyframe)), "");
  AnchorEdit other = Edit(1, 1, "b", Placement::kKeyframe);
  other.anchor.created_utime = 200;
  EXPECT_NE(registry.Take(other), "");
  AnchorEdit deleted = Edit(2, 1, "a", Placement::kSame);
  deleted.deleted = true;
  EXPECT_EQ(registry.Take(deleted), "");
  EXPECT_EQ(registry.Take(other), "");
}

}  // namespace
}  // namespace pangea
