// Pending edits: changes, conflicts, timeouts.

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <set>

#include "anchors/api/anchor_api_test_world.h"

namespace pangea {
namespace {

using nlohmann::json;
using testing::HasSubstr;

constexpr int64_t kSecond_us = 1'000'000;

TEST_F(AnchorApiTest, ItIsRequestedEachSecondAndGivenUpAfterFive) {
  const auto heard = Ask("POST", "/v1/anchors", NewBody(0, NearAgent()));
  for (int i = 0; i < 49; ++i) {
    Pass(kSecond_us / 10);
  }
  EXPECT_EQ(heard->status, 0);
  EXPECT_EQ(requested_.size(), 5u);
  Pass(kSecond_us / 10);
  EXPECT_EQ(heard->status, 503);
  EXPECT_THAT(heard->body.value("error", ""), HasSubstr("pangea-agent-handler"));
  EXPECT_EQ(heard->body["id"], ToString(requested_.back().anchor));
  Pass(kSecond_us);
  EXPECT_EQ(requested_.size(), 5u);
  JournalNewest();  // later nevertheless
  EXPECT_EQ(Get("/v1/anchors").body["anchors"].size(), 1u);
}

TEST_F(AnchorApiTest, AChangeKeepsWhatItDoesNotName) {
  const json made = Make();
  const std::string target = "/v1/anchors/" + made["id"].get<std::string>();
  const auto renamed = Ask("PUT", target, R"({"name": "pot"})");
  ASSERT_EQ(requested_.back().revision, 2);
  EXPECT_EQ(requested_.back().placement, AnchorEdit::Placement::kSame);
  JournalNewest();
  ASSERT_EQ(renamed->status, 200);
  EXPECT_EQ(renamed->headers["ETag"], "\"2\"");
  EXPECT_EQ(renamed->body["name"], "pot");
  EXPECT_EQ(renamed->body["payload"], "hot");
  EXPECT_EQ(renamed->body["pose"], made["pose"]);
  const auto moved = Ask(
      "PUT", target,
      fmt::format(R"({{"pose": {{"keyframe": {{"map": "{}", "seq": 3}}, "position": [1, 0, 0]}}}})",
                  ToString(map(0))));
  JournalNewest();
  EXPECT_EQ(moved->body["name"], "pot");
  EXPECT_GT((PositionOf(moved->body) - PositionOf(made)).norm(), 0.1);
  const auto empty = Ask("PUT", target, "{}");
  EXPECT_EQ(empty->status, 400);
}

TEST_F(AnchorApiTest, AnEditOfWhatIsOldIsAConflict) {
  const std::string target = "/v1/anchors/" + Make()["id"].get<std::string>();
  Ask("PUT", target, R"({"name": "pot"})");
  JournalNewest();
  const size_t before = requested_.size();
  EXPECT_EQ(Ask("PUT", target, R"({"name": "x", "revision": 1})")->status, 409);
  EXPECT_EQ(Ask("PUT", target, R"({"name": "x"})", "\"1\"")->status, 409);
  EXPECT_EQ(Ask("DELETE", target, "", "\"1\"")->status, 409);
  EXPECT_EQ(Ask("DELETE", target, "", "yesterday")->status, 400);
  EXPECT_EQ(Ask("PUT", target, R"({"name": "x", "revision": 1})", "\"2\"")->status, 400);
  EXPECT_EQ(Ask("PUT", target, R"({"name": "x", "revision": 2})", "\"1\"")->status, 400);
  EXPECT_EQ(Ask("DELETE", target, R"({"revision": 1})")->status, 400) << "it is in If-Match";
  EXPECT_EQ(requested_.size(), before);
  const auto good = Ask("PUT", target, R"({"name": "x"})", "\"2\"");
  EXPECT_EQ(Ask("PUT", target, R"({"name": "y"})", "\"2\"")->status, 409) << "one is under way";
  JournalNewest();
  EXPECT_EQ(good->status, 200);
}

// Such an anchor is in a journal of an earlier version; a new edit must have a name.
TEST_F(AnchorApiTest, AChangeOfAnAnchorWithoutANameGivesItOne) {
  Make();
  AnchorEdit nameless = requested_.back();
  nameless.anchor.created_utime += 5;
  nameless.name.clear();
  Journal(nameless);
  const std::string id = ToString(nameless.anchor);
  EXPECT_EQ(Get("/v1/anchors/" + id).body["name"], "");
  const auto changed = Ask("PUT", "/v1/anchors/" + id, R"({"payload": "cold"})");
  JournalNewest();
  EXPECT_EQ(changed->status, 200);
  EXPECT_EQ(changed->body["name"], id);
  nameless.revision = 3;
  nameless.name = "a\xc2\x9b";
  Journal(nameless);
  const auto again = Ask("PUT", "/v1/anchors/" + id, R"({"payload": "hot"})");
  JournalNewest();
  EXPECT_EQ(again->body["name"], id);
}

TEST_F(AnchorApiTest, TwoChangesAtOnceHaveTwoRevisions) {
  const std::string target = "/v1/anchors/" + Make()["id"].get<std::string>();
  const auto first = Ask("PUT", target, R"({"name": "first"})");
  const AnchorEdit first_edit = requested_.back();
  const auto second = Ask("PUT", target, R"({"name": "second"})");
  EXPECT_EQ(requested_.back().revision, 3);
  Journal(first_edit);
  JournalNewest();
  EXPECT_EQ(first->status, 200);
  EXPECT_EQ(second->status, 200);
  EXPECT_EQ(Get(target).body["name"], "second");
}

// Each keeps what the other one changes.
TEST_F(AnchorApiTest, TwoChangesAtOnceOfDifferentFieldsBothCount) {
  const std::string target = "/v1/anchors/" + Make()["id"].get<std::string>();
  const auto renamed = Ask("PUT", target, R"({"name": "pot"})");
  const AnchorEdit rename = requested_.back();
  const auto filled = Ask("PUT", target, R"({"payload": "full"})");
  Journal(rename);
  JournalNewest();
  EXPECT_EQ(renamed->status, 200);
  EXPECT_EQ(filled->status, 200);
  const json anchor = Get(target).body;
  EXPECT_EQ(anchor["name"], "pot");
  EXPECT_EQ(anchor["payload"], "full");
}

TEST_F(AnchorApiTest, AChangeThatTheJournalNeverHadLocksNobodyOut) {
  const std::string target = "/v1/anchors/" + Make()["id"].get<std::string>();
  const auto lost = Ask("PUT", target, R"({"name": "lost"})");
  Pass(5 * kSecond_us);
  EXPECT_EQ(lost->status, 503);
  const auto next = Ask("PUT", target, R"({"name": "next"})", "\"1\"");
  EXPECT_EQ(requested_.back().revision, 3) << "the lost one may still come";
  JournalNewest();
  EXPECT_EQ(next->status, 200);
}

TEST_F(AnchorApiTest, WhoeverLosesToAnotherIsToldSo) {
  const std::string target = "/v1/anchors/" + Make()["id"].get<std::string>();
  const auto ours = Ask("PUT", target, R"({"name": "ours"})");
  AnchorEdit theirs = requested_.back();
  theirs.agent_id = 2;
  theirs.right = AnchorRight::kEditAll;
  theirs.name = "theirs";
  Journal(theirs);
  EXPECT_EQ(ours->status, 0);
  JournalNewest();  // of equal revisions the highest agent wins
  EXPECT_EQ(ours->status, 409);
  EXPECT_THAT(ours->body.value("error", ""), HasSubstr("agent 2"));
  EXPECT_EQ(Get(target).body["name"], "theirs");

  // Another tool on the server used the same revision.
  const auto again = Ask("PUT", target, R"({"name": "again"})");
  AnchorEdit other_tool = requested_.back();
  other_tool.name = "other tool";
  Journal(other_tool);
  EXPECT_EQ(again->status, 409);
  const auto moved = Ask(
      "PUT", target,
      fmt::format(R"({{"pose": {{"keyframe": {{"map": "{}", "seq": 3}}, "position": [1, 0, 0]}}}})",
                  ToString(map(0))));
  other_tool = requested_.back();
  other_tool.T_ref_anchor.q = YawRotation(1);
  Journal(other_tool);
  EXPECT_EQ(moved->status, 409) << "the anchor looks elsewhere";
}

TEST_F(AnchorApiTest, DeletedForEver) {
  const std::string target = "/v1/anchors/" + Make()["id"].get<std::string>();
  const auto deleted = Ask("DELETE", target);
  EXPECT_EQ(deleted->status, 0);
  const auto changed = Ask("PUT", target, R"({"name": "late"})");
  const AnchorEdit change = requested_.back();
  Journal(requested_[requested_.size() - 2]);
  EXPECT_EQ(deleted->status, 204);
  Journal(change);
  EXPECT_EQ(changed->status, 410);
  EXPECT_EQ(Get(target).status, 410);
  EXPECT_EQ(Ask("DELETE", target)->status, 410);
  EXPECT_EQ(Get("/v1/anchors").body["anchors"].size(), 0u);
}

TEST_F(AnchorApiTest, WhatTheJournalsEditIsRefusedForIsSaid) {
  const auto heard = Ask("POST", "/v1/anchors", NewBody(0, NearAgent()));
  api_.Take(requested_.back(), "anchor edit: there are 10000 anchors, max_anchors");
  EXPECT_EQ(heard->status, 409);
  EXPECT_THAT(heard->body.value("error", ""), HasSubstr("max_anchors"));
}

TEST_F(AnchorApiTest, NoMoreAreRequestedThanThereMayBe) {
  AnchorsOptions options;
  options.max_anchors = 3;
  AnchorApi api(anchors_, options, [this](const AnchorEdit& edit) { requested_.push_back(edit); });
  api.Tick(now_utime_, true);
  Make();
  requested_.clear();
  std::vector<int> refused;
  for (int i = 0; i < 5; ++i) {
    api.Answer({"POST", "/v1/anchors", "localhost", "", NewBody(0, NearAgent())},
               [&](const web::WebAnswer& answer) { refused.push_back(answer.status); });
  }
  EXPECT_EQ(requested_.size(), 2u);
  EXPECT_EQ(refused, (std::vector<int>{409, 409, 409}));
}

TEST_F(AnchorApiTest, EditsUnderWayAreBounded) {
  std::vector<std::shared_ptr<Heard>> heard;
  for (size_t i = 0; i <= AnchorApi::kMaxPending; ++i) {
    heard.push_back(Ask("POST", "/v1/anchors", NewBody(0, NearAgent())));
  }
  EXPECT_EQ(heard[0]->status, 0);
  EXPECT_EQ(heard.back()->status, 503);
  std::set<AnchorId> ids;
  for (const AnchorEdit& edit : requested_) {
    ids.insert(edit.anchor);
  }
  EXPECT_EQ(ids.size(), AnchorApi::kMaxPending) << "no number twice";
}

}  // namespace
}  // namespace pangea
