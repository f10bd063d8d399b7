#include "anchors/api/edit_body.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace pangea {
namespace {

using testing::HasSubstr;

EditBody Good(const std::string& text, BodyOf of = BodyOf::kNew) {
  const auto parsed = ParseEditBody(text, of);
  if (const auto* const bad = std::get_if<BadField>(&parsed)) {
    ADD_FAILURE() << text << ": " << bad->field << ": " << bad->error;
    return {};
  }
  return std::get<EditBody>(parsed);
}

BadField Bad(const std::string& text, BodyOf of = BodyOf::kNew) {
  const auto parsed = ParseEditBody(text, of);
  if (std::holds_alternative<EditBody>(parsed)) {
    ADD_FAILURE() << "taken: " << text;
    return {};
  }
  return std::get<BadField>(parsed);
}

TEST(EditBody, APoseInAGroup) {
  const EditBody body = Good(
      R"({"name": "kettle ☕", "payload": "{\"a\": 1}", "pose": {"group": "1/17",
          "position": [1, 2.5, -3], "orientation": [0.6, 0, 0, 0.8]}})");
  EXPECT_EQ(body.name, "kettle ☕");
  EXPECT_EQ(body.payload, R"({"a": 1})");
  const auto& pose = std::get<PoseInGroup>(*body.pose);
  EXPECT_EQ(pose.group, (MapId{1, 17}));
  EXPECT_EQ(pose.T_map_anchor.t, Eigen::Vector3d(1, 2.5, -3));
  EXPECT_DOUBLE_EQ(pose.T_map_anchor.q.w(), 0.6);
  EXPECT_DOUBLE_EQ(pose.T_map_anchor.q.z(), 0.8);
}

TEST(EditBody, APoseByAKeyframeAndOneBehindAPixel) {
  const EditBody by_keyframe = Good(
      R"({"name": "a", "pose": {"keyframe": {"map": "2/17", "seq": 5}, "position": [0, 0, 1]}})");
  const auto& pose = std::get<PoseByKeyframe>(*by_keyframe.pose);
  EXPECT_EQ(pose.keyframe, (KeyframeId{{2, 17}, 5}));
  EXPECT_EQ(pose.T_body_anchor.q.w(), 1);
  const EditBody behind =
      Good(R"({"name": "a", "pose": {"agent": 3, "utime": 1700, "pixel": [376.5, 240]}})");
  EXPECT_EQ(std::get<PoseBehindPixel>(*behind.pose).pixel, Eigen::Vector2d(376.5, 240));
}

TEST(EditBody, AChangeNeedsNoPose) {
  EXPECT_FALSE(Good(R"({"name": "pot"})", BodyOf::kChange).pose);
  EXPECT_EQ(Good(R"({"name": "pot", "revision": 7})", BodyOf::kChange).revision, 7);
  EXPECT_THAT(Bad("{}", BodyOf::kChange).error, HasSubstr("nothing to change"));
  EXPECT_THAT(Bad(R"({"revision": 7})", BodyOf::kChange).error, HasSubstr("nothing to change"));
}

TEST(EditBody, WhatIsWrongIsNamedWithHowToMendIt) {
  const std::string at = R"("pose": {"group": "1/17", "position": [1, 2, 3])";
  const struct {
    std::string text, field, mend;
  } kCases[] = {
      {"", "", "not JSON"},
      {"{", "", "not JSON"},
      {"[]", "", "give an object"},
      {"{\"name\": \"\xff\"}", "", "UTF-8"},
      {R"({"name": "a"})", "pose", "is missing"},
      {"{" + at + "}}", "name", "is missing"},
      {R"({"name": "", )" + at + "}}", "name", "1 to 50 bytes"},
      {"{\"name\": \"a\xc2\x9b\", " + at + "}}", "name", "control characters"},
      {"{\"nam\": 1, " + at + "}}", "nam", "did you mean 'name'"},
      {"{\"revision\": 1, " + at + "}}", "revision", "no such field"},
      {"{\"name\": 1, " + at + "}}", "name", "at most 50 bytes"},
      {"{\"name\": \"" + std::string(51, 'a') + "\", " + at + "}}", "name", "at most 50 bytes"},
      {R"({"name": "a\nb", )" + at + "}}", "name", "one line"},
      {R"({"payload": {"a": 1}, )" + at + "}}", "payload", "a text of at most 1000 bytes"},
      {R"({"payload": "a\u0000b", )" + at + "}}", "payload", "zero byte"},
      {R"({"pose": 1})", "pose", "give {group"},
      {R"({"pose": {"position": [1, 2, 3]}})", "pose", "give {group"},
      {R"({"pose": {"group": "1", "position": [1, 2, 3]}})", "pose.group", "AGENT/OPENED_UTIME"},
      {R"({"pose": {"group": "0/1", "position": [1, 2, 3]}})", "pose.group", "AGENT"},
      {R"({"pose": {"group": "1/-7", "position": [1, 2, 3]}})", "pose.group", "AGENT"},
      {R"({"pose": {"group": "1/17"}})", "pose.position", "is missing"},
      {R"({"pose": {"group": "1/17", "position": [1, 2]}})", "pose.position", "[x, y, z]"},
      {R"({"pose": {"group": "1/17", "position": [1, 2, "3"]}})", "pose.position", "[x, y, z]"},
      {R"({"pose": {"group": "1/17", "position": [1, 2, 1e6]}})", "pose.position", "100 km"},
      {"{" + at + R"(, "orientation": [0, 0, 0, 0]}})", "pose.orientation", "norm 1"},
      {"{" + at + R"(, "orientation": [1, 0, 0]}})", "pose.orientation", "[w, x, y, z]"},
      {"{" + at + R"(, "orientatoin": [1, 0, 0, 0]}})", "pose.orientatoin", "did you mean"},
      {"{" + at + R"(, "pixel": [1, 0]}})", "pose.pixel", "no such field"},
      {R"({"pose": {"keyframe": {"map": "1/17"}, "position": [1, 2, 3]}})", "pose.keyframe.seq",
       "is missing"},
      {R"({"pose": {"keyframe": 1, "position": [1, 2, 3]}})", "pose.keyframe", "give an object"},
      {R"({"pose": {"keyframe": {"map": "1/17", "seq": -1}, "position": [1, 2, 3]}})",
       "pose.keyframe.seq", "0 to 10000000"},
      {R"({"pose": {"agent": 70000, "utime": 1, "pixel": [1, 2]}})", "pose.agent", "1 to 65535"},
      {R"({"pose": {"agent": 1, "utime": 1.5, "pixel": [1, 2]}})", "pose.utime", "whole number"},
      {R"({"pose": {"agent": 1, "utime": 18446744073709551615, "pixel": [1, 2]}})", "pose.utime",
       "whole number"},
      {R"({"pose": {"agent": 1, "utime": 1, "pixel": [1, 1e9]}})", "pose.pixel", "[u, v]"},
  };
  for (const auto& c : kCases) {
    const BadField bad = Bad(c.text);
    EXPECT_EQ(bad.field, c.field) << c.text;
    EXPECT_THAT(bad.error, HasSubstr(c.mend)) << c.text;
  }
  EXPECT_EQ(Bad(R"({"name": "a", "revision": 0})", BodyOf::kChange).field, "revision");
  EXPECT_EQ(Bad(R"({"name": ""})", BodyOf::kChange).field, "name");
  EXPECT_EQ(Bad(R"({"name": "a", "name": "b"})", BodyOf::kChange).error,
            "is given twice: give it once");
  EXPECT_EQ(Bad(R"({"name": "a", "pose": {"group": "1/17", "position": [1, 2, 3],
                                          "position": [1, 2, 4]}})")
                .field,
            "position");
  EXPECT_EQ(Bad(std::string(16'384, '[')).error, "the body is not JSON in UTF-8");
}

TEST(EditBody, Ids) {
  EXPECT_EQ(ParseAnchorId("0", "17"), (AnchorId{0, 17}));
  for (const char* agent : {"", "-1", "+1", " 1", "1 ", "65536", "0x1", "1/2"}) {
    EXPECT_FALSE(ParseAnchorId(agent, "17")) << agent;
  }
  EXPECT_FALSE(ParseAnchorId("1", "99999999999999999999"));
}

}  // namespace
}  // namespace pangea
