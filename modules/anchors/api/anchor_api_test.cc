// Tests every route: placements and refusals.

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <cmath>

#include "anchors/api/anchor_api_test_world.h"

namespace pangea {
namespace {

using nlohmann::json;
using testing::HasSubstr;

TEST_F(AnchorApiTest, AnAnchorIsMadeOnceTheJournalHasIt) {
  const Eigen::Vector3d p = NearAgent();
  const auto heard = Ask("POST", "/v1/anchors", NewBody(0, p));
  EXPECT_EQ(heard->status, 0);
  ASSERT_EQ(requested_.size(), 1u);
  EXPECT_EQ(requested_[0].agent_id, 0);
  EXPECT_EQ(requested_[0].anchor.agent_id, 0);
  EXPECT_EQ(requested_[0].placement, AnchorEdit::Placement::kKeyframe);
  EXPECT_LT(requested_[0].T_ref_anchor.t.norm(), 2);
  EXPECT_EQ(Get("/v1/anchors").body["anchors"].size(), 0u);
  JournalNewest();
  ASSERT_EQ(heard->status, 201);
  const std::string id = heard->body["id"];
  EXPECT_EQ(id, fmt::format("0/{}", now_utime_));
  EXPECT_EQ(heard->headers["Location"], "/v1/anchors/" + id);
  EXPECT_EQ(heard->headers["ETag"], "\"1\"");
  EXPECT_EQ(heard->body["name"], "kettle");
  EXPECT_EQ(heard->body["payload"], "hot");
  EXPECT_EQ(heard->body["made_by"], 0);
  EXPECT_EQ(heard->body["group"], ToString(map(0)));
  EXPECT_EQ(heard->body["deleted"], false);
  EXPECT_EQ(heard->body["sigma_m"].size(), 3u);
  EXPECT_NEAR(heard->body["pose"]["orientation"][0].get<double>(), 1, 1e-3);
  // Keyframes that hold it agree to millimetres.
  EXPECT_LT((PositionOf(heard->body) - p).norm(), 0.01);
  EXPECT_EQ(Get("/v1/anchors/" + id).body, heard->body);
  EXPECT_EQ(Get("/v1/anchors/0%2F" + id.substr(2)).body, heard->body);
  EXPECT_EQ(Get("/v1/anchors").body["anchors"], json::array({heard->body}));
}

TEST_F(AnchorApiTest, APoseOfAFusedGroupIsKeptByTheNearestKeyframe) {
  Fuse();
  const Eigen::Vector3d p =
      world_.T_hall_body({map(1), 10}) * Eigen::Vector3d(0.3, 0, 0.1);  // map frame: the hall's
  Ask("POST", "/v1/anchors", NewBody(0, p));
  ASSERT_EQ(requested_.size(), 1u);
  const KeyframeId held{requested_[0].map, requested_[0].keyframe_seq};
  const double held_m = (world_.T_hall_body(held).t - p).norm();
  for (const SyntheticAgent& agent : world_.agents) {
    for (const Keyframe& keyframe : agent.keyframes) {
      EXPECT_GE((world_.T_hall_body(keyframe.id).t - p).norm(), held_m);
    }
  }
  JournalNewest();
  const json anchors = Get("/v1/anchors?group=" + ToString(map(0))).body["anchors"];
  ASSERT_EQ(anchors.size(), 1u);
  EXPECT_LT((PositionOf(anchors[0]) - p).norm(), 0.02);
  EXPECT_EQ(anchors[0]["group_revision"], 1);
  // The other map is no longer a group.
  const Heard of_none = Get("/v1/anchors?group=" + ToString(map(1)));
  EXPECT_EQ(of_none.status, 404);
  EXPECT_THAT(of_none.body.value("error", ""), HasSubstr("the id of its oldest map"));
  const auto refused = Ask("POST", "/v1/anchors", NewBody(1, p));
  EXPECT_EQ(refused->status, 400);
  EXPECT_EQ(refused->body["field"], "pose.group");
}

// Their odometry and the optimised map differ, by centimetres between the keyframes that hold it.
TEST_F(AnchorApiTest, APoseOfAGroupIsWhereItWasGivenAndStaysAfterRoundTrips) {
  MapState bent = State({0, 1}, 1);
  for (KeyframePose& keyframe : bent.keyframes) {
    keyframe.T_map_body.t.x() *= 1.05;
    keyframe.T_map_body.q = YawRotation(0.004 * keyframe.id.seq) * keyframe.T_map_body.q;
  }
  anchors_.Take(bent);
  const Eigen::Vector3d p = world_.T_hall_body({map(0), 10}) * Eigen::Vector3d(1.5, 0.3, 0);
  const auto made = Ask("POST", "/v1/anchors", NewBody(0, p));
  JournalNewest();
  json anchor = made->body;
  for (int i = 0; i < 8; ++i) {
    EXPECT_LT((PositionOf(anchor) - p).norm(), 1e-5);
    EXPECT_NEAR(std::abs(anchor["pose"]["orientation"][0].get<double>()), 1, 1e-9);
    json pose = anchor["pose"];
    pose["group"] = anchor["group"];
    const auto put =
        Ask("PUT", "/v1/anchors/" + anchor["id"].get<std::string>(), json{{"pose", pose}}.dump());
    JournalNewest();
    ASSERT_EQ(put->status, 200) << put->body;
    anchor = put->body;
  }
}

TEST_F(AnchorApiTest, AnAnchorByAKeyframeAndOneBehindAPixel) {
  const auto by_keyframe = Ask(
      "POST", "/v1/anchors",
      fmt::format(
          R"({{"name": "a", "pose": {{"keyframe": {{"map": "{}", "seq": 4}}, "position": [1, 0, 0]}}}})",
          ToString(map(1))));
  JournalNewest();
  EXPECT_EQ(by_keyframe->status, 201);
  EXPECT_EQ(by_keyframe->body["group"], ToString(map(1)));

  const Keyframe& keyframe = world_.agents[0].keyframes[10];
  ASSERT_FALSE(keyframe.points.empty());
  const Corner& corner = keyframe.corners[keyframe.points[keyframe.points.size() / 2].corner];
  const auto behind =
      Ask("POST", "/v1/anchors",
          fmt::format(R"({{"name": "b", "pose": {{"agent": 1, "utime": {}, "pixel": [{}, {}]}}}})",
                      keyframe.utime, corner.pixel.x(), corner.pixel.y()));
  ASSERT_EQ(requested_.back().placement, AnchorEdit::Placement::kPixel) << behind->body;
  EXPECT_EQ(requested_.back().map, map(0));
  JournalNewest();
  EXPECT_EQ(behind->status, 201) << behind->body;
}

TEST_F(AnchorApiTest, WhatCannotBePlacedIsRefusedBeforeItIsJournalled) {
  const struct {
    std::string pose, field, error;
  } kCases[] = {
      {R"({"group": "9/9", "position": [0, 0, 0]})", "pose.group", "/v1/agents"},
      {fmt::format(R"({{"group": "{}", "position": [0, 0, 5000]}})", ToString(map(0))),
       "pose.position", "1000 m"},
      {R"({"keyframe": {"map": "9/9", "seq": 0}, "position": [0, 0, 0]})", "pose.keyframe",
       "no keyframe 9/9#0"},
      {fmt::format(R"({{"keyframe": {{"map": "{}", "seq": 99}}, "position": [0, 0, 0]}})",
                   ToString(map(0))),
       "pose.keyframe", "no keyframe"},
      {R"({"agent": 9, "utime": 1, "pixel": [1, 2]})", "pose.agent", "/v1/agents"},
      {fmt::format(R"({{"agent": 1, "utime": {}, "pixel": [1, 1]}})",
                   world_.agents[0].keyframes[5].utime),
       "pose", "no surface"},
      {fmt::format(R"({{"agent": 1, "utime": {}, "pixel": [-5000, 2]}})",
                   world_.agents[0].keyframes[5].utime),
       "pose.pixel", "outside the agent's image"},
      {fmt::format(R"({{"agent": 1, "utime": {}, "pixel": [1, 2]}})",
                   world_.agents[0].keyframes[5].utime + 200'000'000'000),
       "pose.utime", "microseconds"},
      {fmt::format(R"({{"agent": 1, "utime": {}, "pixel": [9999, 2]}})",
                   world_.agents[0].keyframes.back().utime + 100'000),
       "pose.pixel", "outside the agent's image"},
      {R"({"group": "1/17", "position": [0, 0]})", "pose.position", "[x, y, z]"},
  };
  for (const auto& c : kCases) {
    const auto heard = Ask("POST", "/v1/anchors", "{\"name\": \"a\", \"pose\": " + c.pose + "}");
    EXPECT_EQ(heard->status, 400) << c.pose;
    EXPECT_EQ(heard->body.value("field", ""), c.field) << c.pose << heard->body;
    EXPECT_THAT(heard->body.value("error", ""), HasSubstr(c.error)) << c.pose;
  }
  EXPECT_TRUE(requested_.empty());
}

TEST_F(AnchorApiTest, AgentsAndTheirAnchors) {
  Make();
  const json agents = Get("/v1/agents").body["agents"];
  ASSERT_EQ(agents.size(), 2u);
  EXPECT_EQ(agents[0], (json{{"id", 1},
                             {"map", ToString(map(0))},
                             {"group", ToString(map(0))},
                             {"group_revision", 0}}));
  EXPECT_EQ(Get("/v1/agents/2/anchors").body["anchors"].size(), 0u);
  Fuse();
  EXPECT_EQ(Get("/v1/agents").body["agents"][1]["group"], ToString(map(0)));
  const Heard of_two = Get("/v1/agents/2/anchors");
  EXPECT_EQ(of_two.body["map"], ToString(map(1)));
  ASSERT_EQ(of_two.body["anchors"].size(), 1u);
  // The same place, seen from each agent's newest keyframe.
  const auto in_hall = [&](int agent) {
    const json anchors = Get(fmt::format("/v1/agents/{}/anchors", agent + 1)).body["anchors"];
    const Keyframe& newest = world_.agents[agent].keyframes.back();
    return Eigen::Vector3d(world_.T_hall_body(newest.id) *
                           (newest.T_odom_body.Inverse() * PositionOf(anchors[0])));
  };
  EXPECT_LT((in_hall(0) - in_hall(1)).norm(), 1e-6);
  EXPECT_EQ(Get("/v1/agents/3/anchors").status, 404);
  EXPECT_EQ(Get("/v1/agents/x/anchors").status, 404);
}

TEST_F(AnchorApiTest, AnAnchorThatWaitsHasNoPose) {
  AnchorEdit edit;
  edit.anchor = {2, 7};
  edit.agent_id = 2;
  edit.right = AnchorRight::kEditOwn;
  edit.payload = "\xff";  // not of this API: apps on the bus may send any bytes
  edit.placement = AnchorEdit::Placement::kKeyframe;
  edit.map = map(1);
  edit.keyframe_seq = 1000;
  Journal(edit);
  const Heard heard = Get("/v1/anchors/2/7");
  EXPECT_EQ(heard.status, 200);
  EXPECT_TRUE(heard.body["pose"].is_null());
  EXPECT_TRUE(heard.body["group"].is_null());
  EXPECT_EQ(heard.body["payload"], "\xEF\xBF\xBD");
}

TEST_F(AnchorApiTest, UntilTheJournalIsReadNothingIsAnsweredWithLess) {
  complete_ = false;
  Pass(0);
  for (const char* target : {"/v1/anchors", "/v1/agents", "/v1/anchors/0/1"}) {
    Heard heard = Get(target);
    EXPECT_EQ(heard.status, 503) << target;
    EXPECT_EQ(heard.headers["Retry-After"], "1") << target;
  }
  EXPECT_EQ(Ask("POST", "/v1/anchors", NewBody(0, NearAgent()))->status, 503);
  EXPECT_EQ(Get("/v1/openapi.json").status, 200);
}

TEST_F(AnchorApiTest, WhatIsNotThere) {
  for (const char* target : {"/", "", "/v1", "/v1/", "/v2/anchors", "/v1/anchors/", "/v1/anchors/1",
                             "/v1/anchors/1/2/3", "/v1/agents/1", "/v1/agents/1/keyframes", "*",
                             "/v1/anchors/1/2", "/v1/anchors/a/b", "/%", "/v1/%2", "?", "/v1?x"}) {
    EXPECT_EQ(Get(target).status, 404) << target;
  }
  for (const char* target : {"/v1/anchors?x=1", "/v1/anchors?group=", "/v1/anchors?group=1"}) {
    EXPECT_EQ(Get(target).status, 400) << target;
  }
  EXPECT_EQ(Get("/v1/events").status, 426);
  EXPECT_EQ(api_.Open({"GET", "/v1/anchors", "", "", ""}), nullptr);
  EXPECT_NE(api_.Open({"GET", "/v1/events", "", "", ""}), nullptr);
}

TEST_F(AnchorApiTest, OnlyTheMethodsThereAre) {
  const std::string one = "/v1/anchors/" + Make()["id"].get<std::string>();
  const std::pair<std::string, std::string> kCases[] = {
      {"/v1/anchors", "GET, POST"},    {one, "GET, PUT, DELETE"},   {"/v1/agents", "GET"},
      {"/v1/agents/1/anchors", "GET"}, {"/v1/openapi.json", "GET"}, {"/v1/events", "GET"}};
  for (const auto& [target, methods] : kCases) {
    const auto heard = Ask("PATCH", target);
    EXPECT_EQ(heard->status, 405) << target;
    EXPECT_EQ(heard->headers["Allow"], methods) << target;
  }
}

TEST_F(AnchorApiTest, ItsDescriptionIsJson) {
  const json document = Get("/v1/openapi.json").body;
  for (const char* path : {"/v1/anchors", "/v1/anchors/{agent}/{number}", "/v1/agents",
                           "/v1/agents/{agent}/anchors", "/v1/events", "/v1/openapi.json"}) {
    EXPECT_TRUE(document["paths"].contains(path)) << path;
  }
  EXPECT_EQ(document["paths"].size(), 6u);
}

}  // namespace
}  // namespace pangea
