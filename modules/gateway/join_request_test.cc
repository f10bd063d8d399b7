#include "gateway/join_request.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

#include "gateway/attempt_limit.h"

namespace pangea {
namespace {

using testing::HasSubstr;
using testing::MatchesRegex;

JoinRequest Good(std::string_view body) {
  const auto parsed = ParseJoinRequest(body);
  const auto* const request = std::get_if<JoinRequest>(&parsed);
  EXPECT_NE(request, nullptr) << body;
  return request == nullptr ? JoinRequest{} : *request;
}

std::string Bad(const std::string& body) {
  const auto parsed = ParseJoinRequest(body);
  const auto* const error = std::get_if<std::string>(&parsed);
  EXPECT_NE(error, nullptr) << body;
  return error == nullptr ? "" : *error;
}

TEST(JoinCode, IsRandomAndReadByPeople) {
  std::set<std::string> codes;
  for (int i = 0; i < 100; ++i) {
    codes.insert(NewJoinCode());
  }
  EXPECT_EQ(codes.size(), 100U);
  EXPECT_THAT(*codes.begin(), MatchesRegex("([0-9A-HJKMNP-TV-Z]{4}-){3}[0-9A-HJKMNP-TV-Z]{4}"));
  EXPECT_EQ(PlainJoinCode(*codes.begin()).size(), kCodeLetters);
}

TEST(JoinCode, ForgivesCaseDashesAndLettersLikeDigits) {
  EXPECT_EQ(PlainJoinCode("ABCD-EFGH-JKMN-PQRS"), "ABCDEFGHJKMNPQRS");
  EXPECT_EQ(PlainJoinCode(" abcd efgh jkmnpqrs"), "ABCDEFGHJKMNPQRS");
  EXPECT_EQ(PlainJoinCode("oil0-0000-0000-0000"), "0110000000000000");
  for (const char* text : {"", "ABCD-EFGH-JKMN-PQR", "ABCD-EFGH-JKMN-PQRST", "ABCD-EFGH-JKMN-PQRU",
                           "ABCD_EFGH_JKMN_PQRS", "ABCD-EFGH-JKMN-PQR\xc3"}) {
    EXPECT_EQ(PlainJoinCode(text), "") << text;
  }
}

TEST(JoinRequest, TakesCodeAndName) {
  const JoinRequest request = Good(R"({"code": "abcd-efgh-jkmn-pqrs", "name": "Anna Müller"})");
  EXPECT_EQ(request.code, "ABCDEFGHJKMNPQRS");
  EXPECT_EQ(request.name, "Anna Müller");
  EXPECT_EQ(Good(R"({"code": "ABCD-EFGH-JKMN-PQRS"})").name, "");
}

TEST(JoinRequest, SaysWhatIsWrong) {
  for (const char* body : {"", "{", "[]", "7", "null", "\"code\""}) {
    EXPECT_THAT(Bad(body), HasSubstr("no JSON object")) << body;
  }
  EXPECT_THAT(Bad(R"({"code": 7})"), HasSubstr("both texts"));
  EXPECT_THAT(Bad(R"({"code": "ABCD-EFGH-JKMN-PQRS", "agent": "1"})"), HasSubstr("nothing else"));
  EXPECT_THAT(Bad(R"({"name": "Anna"})"), HasSubstr("no code"));
  EXPECT_THAT(Bad(R"({"code": "ABCD"})"), HasSubstr("16 letters"));
  EXPECT_THAT(Bad(R"({"code": "ABCD-EFGH-JKMN-PQRS", "name": "a\nb"})"),
              HasSubstr("cannot be shown"));
  EXPECT_THAT(Bad(R"({"code": "ABCD-EFGH-JKMN-PQRS", "name": ")" + std::string(121, 'x') + "\"}"),
              HasSubstr("too long"));
}

// In turn: a byte that never occurs, a cut sequence, a longer form of "/", half a surrogate pair,
// and a number that is no character.
const char* const kNotUtf8[] = {"\xff", "Ann\xc3", "\xc0\xaf", "\xed\xa0\x80", "\xf4\x90\x80\x80"};

TEST(JoinRequest, ANameIsUtf8) {
  EXPECT_TRUE(IsVisitorName("アンナ"));
  std::string longest;  // of what fits in the page's field: 40 characters of three bytes
  for (int i = 0; i < 40; ++i) {
    longest += "名";
  }
  EXPECT_TRUE(IsVisitorName(longest));
  for (const std::string name : kNotUtf8) {
    EXPECT_FALSE(IsVisitorName(name)) << testing::PrintToString(name);
    EXPECT_THAT(Bad(R"({"code": "ABCD-EFGH-JKMN-PQRS", "name": ")" + name + "\"}"),
                HasSubstr("no JSON object"));
  }
  EXPECT_THAT(Bad(R"({"code": "ABCD-EFGH-JKMN-PQRS", "name": "\ud800"})"),
              HasSubstr("no JSON object"));
}

// The name is printed on the terminal of whoever runs `pangea-gateway list`.
TEST(JoinRequest, ANameHasNoControlCharacters) {
  for (const std::string name : {"\x1b[2J", "\x7f",
                                 "\xc2\x9b"
                                 "2J",
                                 "Anna\xc2\x80"}) {
    EXPECT_FALSE(IsVisitorName(name)) << testing::PrintToString(name);
  }
  EXPECT_TRUE(IsVisitorName("Anna\xc2\xa0M\xc3\x9bller"));
}

TEST(AttemptLimit, SoManyAtOnceThenOneInAWhile) {
  AttemptLimit limit;
  int64_t now = 1'000'000;
  for (int i = 0; i < AttemptLimit::kBurst; ++i) {
    EXPECT_TRUE(limit.MayTry("10.0.0.1", now)) << i;
    limit.NoteWrong("10.0.0.1", now);
  }
  EXPECT_FALSE(limit.MayTry("10.0.0.1", now));
  EXPECT_TRUE(limit.MayTry("10.0.0.2", now)) << "another address";
  now += AttemptLimit::kInterval_us;
  EXPECT_TRUE(limit.MayTry("10.0.0.1", now));
  limit.NoteWrong("10.0.0.1", now);
  EXPECT_FALSE(limit.MayTry("10.0.0.1", now));
  now += AttemptLimit::kBurst * AttemptLimit::kInterval_us;
  for (int i = 0; i < AttemptLimit::kBurst; ++i) {
    EXPECT_TRUE(limit.MayTry("10.0.0.1", now)) << i << ", all is forgotten";
    limit.NoteWrong("10.0.0.1", now);
  }
}

TEST(AttemptLimit, ManyAddressesTakeNoMoreMemory) {
  AttemptLimit limit;
  for (size_t i = 0; i < AttemptLimit::kMaxAddresses; ++i) {
    const std::string address = "10.0." + std::to_string(i / 256) + "." + std::to_string(i % 256);
    EXPECT_TRUE(limit.MayTry(address, 1));
    limit.NoteWrong(address, 1);
  }
  EXPECT_FALSE(limit.MayTry("10.1.0.0", 1));
  EXPECT_TRUE(limit.MayTry("10.0.0.0", 1)) << "it was wrong once only";
  EXPECT_TRUE(limit.MayTry("10.1.0.0", 1 + AttemptLimit::kInterval_us));
}

}  // namespace
}  // namespace pangea
