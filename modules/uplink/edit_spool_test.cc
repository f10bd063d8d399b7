#include "uplink/edit_spool.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>
#include <map>

#include "files/testing/full_disk.h"
#include "messages/encoding.h"
#include "messages/testing/test_anchors.h"
#include "uplink/test_ids.h"

namespace pangea {
namespace {

namespace fs = std::filesystem;

constexpr AnchorId kOfAnother{2, 7};

class EditSpoolTest : public testing::Test {
 protected:
  void SetUp() override {
    folder = fs::path(testing::TempDir()) / ("edit_spool_" + std::to_string(getpid()));
    fs::remove_all(folder);
    fs::create_directories(folder);
  }
  void TearDown() override { fs::remove_all(folder); }
  std::map<AnchorId, int64_t> Left() const {
    std::map<AnchorId, int64_t> left;
    for (const AnchorEdit& edit : EditSpool(folder, 1).TakeLeft()) {
      left[edit.anchor] = edit.revision;
    }
    return left;
  }
  fs::path folder;
};

using Revisions = std::map<AnchorId, int64_t>;

TEST_F(EditSpoolTest, TheNewestOfEachAnchorIsLeft) {
  EditSpool spool(folder, 1);
  EXPECT_TRUE(spool.TakeLeft().empty());
  spool.Put(TestEdit(kA, 1, 1));
  spool.Put(TestEdit(kOfAnother, 3, 1));
  spool.Put(TestEdit(kA, 2, 1));
  spool.Put(TestEdit(kB, 1, 1));
  spool.Remove(kB, 1);
  spool.Remove(kA, 1);  // an answer to the one before
  spool.Sync();
  EXPECT_EQ(Left(), (Revisions{{kA, 2}, {kOfAnother, 3}}));
  const AnchorEdit left = EditSpool(folder, 1).TakeLeft().front();
  EXPECT_EQ(EncodeMessage(ToMessage(left)), EncodeMessage(ToMessage(TestEdit(kA, 2, 1))));
}

TEST_F(EditSpoolTest, WhatIsLeftGoesWhenItIsAnswered) {
  EditSpool(folder, 1).Put(TestEdit(kA, 4, 1));
  EditSpool spool(folder, 1);
  spool.TakeLeft();
  spool.Remove(kA, 4);
  EXPECT_TRUE(fs::is_empty(folder));
}

TEST_F(EditSpoolTest, DamageCostsOneEditAndIsKept) {
  EditSpool spool(folder, 1);
  spool.Put(TestEdit(kA, 1, 1));
  spool.Put(TestEdit(kB, 1, 1));
  std::fstream file(folder / "anchor_1_1.lcm", std::ios::in | std::ios::out | std::ios::binary);
  file.seekp(120);
  file.put('~');
  file.close();
  EXPECT_EQ(Left(), (Revisions{{kB, 1}}));
  EXPECT_EQ(Left(), (Revisions{{kB, 1}}));
  EXPECT_EQ(std::distance(fs::directory_iterator(folder), fs::directory_iterator()), 2);
}

// Neither what a killed run was writing, nor what cannot be read, is in the way.
TEST_F(EditSpoolTest, WhatAKilledRunLeftIsRemoved) {
  EditSpool(folder, 1).Put(TestEdit(kA, 1, 1));
  std::ofstream(folder / "anchor_1_2.lcm.new") << "a part";
  fs::create_directories(folder / "anchor_1_3.lcm" / "kept");
  EXPECT_EQ(Left(), (Revisions{{kA, 1}}));
  EXPECT_FALSE(fs::exists(folder / "anchor_1_2.lcm.new"));
  EXPECT_FALSE(fs::exists(folder / "anchor_1_3.lcm"));
  EXPECT_EQ(std::distance(fs::directory_iterator(folder), fs::directory_iterator()), 2);
}

TEST_F(EditSpoolTest, AnotherAgentsIsRefusedAndStays) {
  EditSpool(folder, 1).Put(TestEdit(kA, 1, 1));
  EXPECT_THROW(EditSpool(folder, 2).TakeLeft(), std::runtime_error);
  EXPECT_EQ(Left(), (Revisions{{kA, 1}}));
}

TEST_F(EditSpoolTest, AFullDiskLeavesTheOneBefore) {
  EditSpool spool(folder, 1);
  spool.Put(TestEdit(kA, 1, 1));
  EXPECT_FALSE(spool.refuses());
  {
    const FullDisk full(100);
    spool.Put(TestEdit(kA, 2, 1));
  }
  EXPECT_TRUE(spool.refuses());
  EXPECT_EQ(Left(), (Revisions{{kA, 1}}));
  spool.Remove(kA, 2);
  EXPECT_TRUE(fs::is_empty(folder)) << "the newer one was answered";
  spool.Put(TestEdit(kA, 3, 1));
  EXPECT_FALSE(spool.refuses());
}

}  // namespace
}  // namespace pangea
