#include "log_tools/message_fields.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <set>

#include "log_file/log_reader.h"
#include "messages/encoding.h"
#include "pangea/place_match_t.hpp"

namespace pangea {
namespace {

using testing::Contains;

std::vector<uint8_t> Match() {
  place_match_t match{};
  match.query.map.agent_id = 7;
  match.query.map.opened_utime = -1'700'000'000'000'000;
  match.query.seq = 12;
  place_candidate_t candidate{};
  candidate.kind = place_candidate_t::KIND_INTER;
  candidate.score = 0.25F;
  candidate.query_corner = {3, 300};
  candidate.match_corner = {4, -1};
  candidate.num_matches = 2;
  match.candidates = {place_candidate_t{}, candidate};
  match.num_candidates = 2;
  match.rejected = {"far"};
  match.num_rejected = 1;
  return EncodeMessage(match);
}

TEST(MessageFields, AreThoseOfTheType) {
  const auto message = DecodeFields(Match());
  ASSERT_TRUE(message);
  EXPECT_EQ(message->type, "place_match_t");
  std::map<std::string, std::string> fields;
  for (const MessageField& field : message->fields) {
    EXPECT_TRUE(fields.emplace(field.path, field.value).second) << field.path << " stands twice";
  }
  EXPECT_EQ(fields["query.map.agent_id"], "7");
  EXPECT_EQ(fields["query.map.opened_utime"], "-1700000000000000");
  EXPECT_EQ(fields["query.seq"], "12");
  EXPECT_EQ(fields["candidates[0].num_matches"], "0");
  EXPECT_EQ(fields["candidates[1].kind"], "2");
  EXPECT_EQ(fields["candidates[1].score"], "0.25");
  EXPECT_EQ(fields["candidates[1].query_corner[1]"], "300");
  EXPECT_EQ(fields["candidates[1].match_corner[1]"], "-1");
  EXPECT_EQ(fields["rejected[0]"], "\"far\"");
}

TEST(MessageFields, AreJsonToo) {
  const auto json = ToJson(DecodeFields(Match()).value());
  EXPECT_EQ(json["query"]["seq"], 12);
  EXPECT_EQ(json["candidates"].size(), 2u);
  EXPECT_EQ(json["candidates"][1]["match_corner"], nlohmann::ordered_json({4, -1}));
  EXPECT_EQ(json["candidates"][1]["score"], 0.25);
  EXPECT_EQ(json["rejected"][0], "far");
  EXPECT_EQ(ToJson({"", {{"id", "9007199254740993"}}})["id"], "9007199254740993");
  EXPECT_TRUE(ToJson({"", {{"x", "nan"}}})["x"].is_null());
}

TEST(MessageFields, WhatDoesNotFitIsNone) {
  const std::vector<uint8_t> good = Match();
  for (size_t size = 0; size < good.size(); ++size) {
    EXPECT_FALSE(DecodeFields(Bytes(good.data(), size))) << size;
  }
  std::vector<uint8_t> longer = good;
  longer.push_back(0);
  EXPECT_FALSE(DecodeFields(longer));
  std::vector<uint8_t> other = good;
  other[0] ^= 1;
  EXPECT_FALSE(DecodeFields(other));
  EXPECT_FALSE(TypeOf(other));
  place_match_t negative{};
  negative.num_rejected = -1;
  std::vector<uint8_t> bytes = EncodeMessage(negative);
  EXPECT_FALSE(DecodeFields(bytes));
  // Absurd counts end with the bytes.
  for (size_t i = 8; i < good.size(); ++i) {
    std::vector<uint8_t> damaged = good;
    damaged[i] = 0x7F;
    DecodeFields(damaged);
  }
}

TEST(MessageFields, EveryMessageOfACaptureDecodes) {
  std::set<std::string> types;
  ReadLog(std::string(PANGEA_SOURCE_DIR) + "/logs/two_walks/session.lcm",
          [&types](const LogEvent& event) {
            if (event.channel == "LCM_SELF_TEST") {
              return;
            }
            const auto message = DecodeFields(event.data);
            ASSERT_TRUE(message) << event.channel;
            types.insert(message->type);
          });
  for (const char* type : {"keyframe_t", "place_match_t", "constraint_t", "map_state_t",
                           "correction_t", "status_t", "have_t"}) {
    EXPECT_THAT(types, Contains(type));
  }
}

}  // namespace
}  // namespace pangea
