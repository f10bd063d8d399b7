// Anchors over a link that loses, doubles and reorders, while either end is killed.

#include <fstream>
#include <random>

#include "agent_handler/anchor_link_test_world.h"
#include "messages/encoding.h"

namespace pangea {
namespace {

// Apps repeat what they have not seen come back: without a spool a killed uplink forgets it.
TEST_F(AnchorLink, EditsAreJournalledOnceEachThoughBothEndsAreKilled) {
  MakeLinkBad();
  std::mt19937_64 rng(5);
  constexpr int kAnchors = 30;
  std::map<AnchorId, int64_t> wanted;
  for (int round = 0; round < 12; ++round) {
    for (int i = 0; i < 10; ++i) {
      const AnchorId id{1, static_cast<int64_t>(rng() % kAnchors)};
      ++wanted[id];
    }
    for (const auto& [id, revision] : wanted) {
      Request(TestEdit(id, revision, 1));
    }
    Run(0.02 * static_cast<double>(rng() % 100));
    if (round % 3 == 0) {
      KillHandler();
      Run(0.1);
      StartHandler();
    } else if (round % 3 == 1) {
      KillUplink();
      StartUplink();
    }
  }
  for (const auto& [id, revision] : wanted) {
    Request(TestEdit(id, revision, 1));
  }
  Run(60);
  FillGaps();
  ExpectOnceEach(journalled.size());
  std::map<AnchorId, int64_t> newest;
  for (const auto& [id, edit] : NewestJournalled()) {
    newest[id] = edit.revision;
  }
  EXPECT_EQ(newest, wanted);
  EXPECT_EQ(uplink_counters.at("anchor_edits_waiting"), 0);
}

// Made, moved, renamed, deleted, each said once; a file that the killed process was writing lies
// beside the others.
TEST_F(AnchorLink, AKilledUplinkWithASpoolLosesNoEdit) {
  KillUplink();
  spools_edits = true;
  StartUplink();
  MakeLinkBad();
  std::mt19937_64 rng(11);
  std::map<AnchorId, AnchorEdit> wanted;
  for (int i = 0; i < 120; ++i) {
    const AnchorId id{1, static_cast<int64_t>(rng() % 40)};
    AnchorEdit edit = TestEdit(id, i + 1, 1);
    if (wanted[id].deleted) {
      continue;
    }
    edit.deleted = i > 60 && rng() % 4 == 0;
    if (rng() % 3 == 0 && wanted[id].revision > 1) {
      edit.placement = AnchorEdit::Placement::kSame;
      edit.name = "pot";
    }
    wanted[id] = edit;
    Request(edit);
    Run(0.01 * static_cast<double>(rng() % 8));
    if (i % 4 == 0) {
      KillUplink();
      std::ofstream(folder / "anchor_1_5.lcm.new") << "torn";
      StartUplink();
    }
    if (i % 25 == 0) {
      KillHandler();
      Run(0.1);
      StartHandler();
    }
  }
  Run(60);
  ExpectOnceEach(journalled.size());
  std::map<AnchorId, AnchorEdit> newest = NewestJournalled();
  ASSERT_EQ(newest.size(), wanted.size());
  for (const auto& [id, edit] : wanted) {
    EXPECT_EQ(newest[id].revision, edit.revision);
    EXPECT_EQ(newest[id].deleted, edit.deleted);
    EXPECT_EQ(newest[id].name, edit.name);
  }
  EXPECT_EQ(uplink_counters.at("anchor_edits_waiting"), 0);
  const size_t before = journalled.size();
  KillUplink();
  uplink_counters.clear();
  StartUplink();
  Run(5);
  EXPECT_EQ(journalled.size(), before) << "what was answered is not sent again";
  EXPECT_FALSE(uplink_counters.contains("anchor_edits"));
}

// Before a keyframe has said where that was: then as it was known live.
TEST_F(AnchorLink, AKilledUplinkWithASpoolLosesNoTap) {
  KillUplink();
  spools_edits = true;
  StartUplink();
  RequestTap();
  Run(0.1);
  KillUplink();
  EXPECT_TRUE(journalled.empty());
  StartUplink();
  Run(2);
  ASSERT_EQ(journalled.size(), 1u);
  ASSERT_TRUE(journalled[0].T_odom_body);
  EXPECT_NEAR(journalled[0].T_odom_body->t.x(), 0.25, 1e-9);
}

// None that the uplink took is lost when only the server dies, however often.
TEST_F(AnchorLink, AKilledServerLosesNoEdit) {
  MakeLinkBad();
  for (int i = 0; i < 50; ++i) {
    Request(TestEdit({1, i}, 1, 1));
    Run(0.05);
    if (i % 5 == 4) {
      KillHandler();
      Run(0.05);
      StartHandler();
    }
  }
  Run(40);
  ExpectOnceEach(50);
  const size_t before = journalled.size();
  for (int i = 0; i < 50; ++i) {
    Request(TestEdit({1, i}, 1, 1));  // once more, all of it
  }
  KillHandler();
  StartHandler();
  Run(40);
  EXPECT_EQ(journalled.size(), before);
  EXPECT_EQ(uplink_counters.at("anchor_edits_waiting"), 0);
}

TEST_F(AnchorLink, TheNewestStateOfEachAnchorArrivesOverABadLink) {
  MakeLinkBad();
  std::mt19937_64 rng(6);
  std::map<AnchorId, AnchorState> newest;
  for (int i = 0; i < 190; ++i) {
    const AnchorId id{2, static_cast<int64_t>(rng() % 20)};
    AnchorState& state = newest[id];
    state = TestAnchor(id, state.revision + 1, kMap, {0.1 * i, 1, 2});
    state.gone = i > 150 && rng() % 2 == 0;
    PublishAnchor(state);
    Run(0.05);
    if (i % 40 == 20) {
      KillUplink();
      StartUplink();
    }
    if (i % 40 == 39) {
      KillHandler();
      StartHandler();
      for (const auto& [unused, all] : newest) {
        PublishAnchor(all);  // as pangea-anchors does every ten seconds
      }
    }
  }
  Run(30);
  ASSERT_EQ(heard.size(), newest.size());
  for (const auto& [id, state] : newest) {
    EXPECT_EQ(EncodeMessage(ToMessage(heard.at(id))), EncodeMessage(ToMessage(state)));
  }
  EXPECT_EQ(handler_counters.at("anchors_unconfirmed"), 0);
}

TEST_F(AnchorLink, ARestartedUplinkHearsAllAgain) {
  for (int i = 0; i < 20; ++i) {
    PublishAnchor(TestAnchor({2, i}, 1, kMap));
  }
  Run(8);
  EXPECT_EQ(heard.size(), 20u);
  heard.clear();
  KillUplink();
  StartUplink();
  Run(8);
  EXPECT_EQ(heard.size(), 20u);
}

}  // namespace
}  // namespace pangea
