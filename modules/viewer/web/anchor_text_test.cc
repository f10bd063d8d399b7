#include "viewer/web/anchor_text.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "viewer/viewer_test_world.h"
#include "viewer/web/page_link.h"

namespace pangea::viewer {
namespace {

using nlohmann::json;

json UpdateOf(const std::vector<uint8_t>& bytes) {
  const size_t length = bytes[0] + 256U * bytes[1] + 65536U * bytes[2];
  return json::parse(bytes.begin() + 4, bytes.begin() + 4 + static_cast<std::ptrdiff_t>(length));
}

TEST(AnchorText, ThePageChangesAnchors) {
  TestShow show;
  PageLink link(show);
  ASSERT_TRUE(link.Receive(
      R"({"anchor_add": {"name": "Kühlschrank", "keyframe": 7, "p_body": [1, -2.5, 3]}})"));
  ASSERT_TRUE(link.Receive(
      R"({"anchor_move": {"anchor": [65535, 1800000000000000], "keyframe": 0, "p_body": [0, 0, 0]}})"));
  ASSERT_TRUE(link.Receive(R"({"anchor_delete": {"anchor": [0, 17]}})"));
  ASSERT_EQ(show.changes_.size(), 3U);
  EXPECT_FALSE(show.changes_[0].anchor);
  EXPECT_EQ(show.changes_[0].name, "Kühlschrank");
  EXPECT_EQ(show.changes_[0].keyframe, 7);
  EXPECT_EQ(show.changes_[0].p_body, Eigen::Vector3d(1, -2.5, 3));
  EXPECT_EQ(show.changes_[1].anchor, (AnchorId{65535, 1'800'000'000'000'000}));
  EXPECT_FALSE(show.changes_[1].deleted);
  EXPECT_EQ(show.changes_[2].anchor, (AnchorId{0, 17}));
  EXPECT_TRUE(show.changes_[2].deleted);
}

TEST(AnchorText, OfALogNobodyChangesAnchors) {
  TestShow show;
  show.editable_ = false;
  PageLink link(show);
  EXPECT_FALSE(link.Receive(R"({"anchor_delete": {"anchor": [0, 17]}})"));
  EXPECT_TRUE(show.changes_.empty());
}

TEST(AnchorText, NoPageOfOursSaysThis) {
  TestShow show;
  PageLink link(show);
  const std::string place = R"("keyframe": 1, "p_body": [0, 0, 1])";
  const std::vector<std::string> changes = {
      R"("anchor_add": {"keyframe": 1, "p_body": [0, 0, 1]})",
      R"("anchor_add": {"name": "", )" + place + "}",
      R"("anchor_add": {"name": 7, )" + place + "}",
      R"("anchor_add": {"name": "a\nb", )" + place + "}",
      R"("anchor_add": {"name": "a\u009bb", )" + place + "}",
      R"("anchor_add": {"name": "a\u0000b", )" + place + "}",
      R"("anchor_add": {"name": ")" + std::string(101, 'a') + R"(", )" + place + "}",
      R"("anchor_add": {"name": "a", "payload": "b", )" + place + "}",
      R"("anchor_add": {"name": "a", "keyframe": -1, "p_body": [0, 0, 1]})",
      R"("anchor_add": {"name": "a", "keyframe": 1.5, "p_body": [0, 0, 1]})",
      R"("anchor_add": {"name": "a", "keyframe": 50000, "p_body": [0, 0, 1]})",
      R"("anchor_add": {"name": "a", "keyframe": 18446744073709551615, "p_body": [0, 0, 1]})",
      R"("anchor_add": {"name": "a", "keyframe": 1, "p_body": [0, 0]})",
      R"("anchor_add": {"name": "a", "keyframe": 1, "p_body": [0, 0, 1, 2]})",
      R"("anchor_add": {"name": "a", "keyframe": 1, "p_body": [0, 0, 1e5]})",
      R"("anchor_add": {"name": "a", "keyframe": 1, "p_body": [0, 0, 1e999]})",
      R"("anchor_add": {"name": "a", "keyframe": 1, "p_body": [0, 0, null]})",
      R"("anchor_add": {"name": "a", "keyframe": 1, "p_body": {"0": 1}})",
      R"("anchor_add": null)",
      R"("anchor_add": [])",
      R"("anchor_move": {"anchor": [0, 17], "name": "a", )" + place + "}",
      R"("anchor_move": {"anchor": [0], )" + place + "}",
      R"("anchor_move": {"anchor": [-1, 17], )" + place + "}",
      R"("anchor_move": {"anchor": [65536, 17], )" + place + "}",
      R"("anchor_move": {"anchor": [0, 9007199254740993], )" + place + "}",
      R"("anchor_delete": {"anchor": "0/17"})",
      R"("anchor_delete": {"anchor": [0, 17], "name": "a"})",
      R"("anchor_delete": [0, 17])",
      R"("anchor_rename": {"anchor": [0, 17]})"};
  for (const std::string& change : changes) {
    EXPECT_FALSE(link.Receive("{" + change + "}")) << change;
  }
  EXPECT_FALSE(link.Receive("{\"anchor_add\": {\"name\": \"a\xff\", " + place + "}}"));
  EXPECT_TRUE(show.changes_.empty());
}

TEST(AnchorText, ThePageIsTold) {
  TestShow show;
  show.scene_.Take(TestAnchor(3, TestMap(1)));
  show.scene_.SetTime(2);
  show.scene_.Tell("the server did not answer");
  PageLink link(show);
  const json update = UpdateOf(link.Next().value());
  EXPECT_EQ(update["start"]["editable"], true);
  EXPECT_EQ(update["notice"], json({{"time_s", 2.0}, {"text", "the server did not answer"}}));
  ASSERT_EQ(update["anchors"].size(), 1U);
  const json& anchor = update["anchors"][0];
  EXPECT_EQ(anchor["id"], json({1, 3}));
  EXPECT_EQ(anchor["name"], "anchor 3");
  EXPECT_EQ(anchor["group"], 0);
  EXPECT_EQ(anchor["T_map_anchor"], json({0.0, 0.0, 3.0, 1.0, 0.0, 0.0, 0.0}));
  EXPECT_EQ(anchor["sigma_m"], 0.01);
  EXPECT_EQ(anchor["gone"], false);

  AnchorState gone = TestAnchor(3, TestMap(1));
  gone.gone = true;
  show.scene_.Take(gone);
  ASSERT_TRUE(link.Receive(R"({"taken": 1})"));
  EXPECT_EQ(UpdateOf(link.Next().value())["anchors"][0],
            json({{"index", 0}, {"id", {1, 3}}, {"gone", true}}));
}

}  // namespace
}  // namespace pangea::viewer
