#include "report/expectations.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <stdexcept>

namespace pangea {
namespace {

using nlohmann::ordered_json;
using testing::ElementsAre;
using testing::HasSubstr;

// Two agents: fused at 20 s, separated at 25 s, fused again at 30 s and once more, with a third
// map.
ordered_json Report() {
  return ordered_json::parse(R"({
    "agents": [
      {"id": 1, "map_ids": ["1/10"], "map_ids_not_compared": [], "coverage": 0.99, "ate_vio_m": 0.04, "ate_server_m": 0.02},
      {"id": 2, "map_ids": ["2/10", "2/20"], "map_ids_not_compared": [],
       "coverage": 0.7, "ate_vio_m": 0.03, "ate_server_m": null}],
    "groups": [{"agents": [1, 2]}],
    "ate_joint_m": 0.05,
    "constraints_truth": {"checked": 12, "wrong": 1},
    "anchors": [
      {"name": "kettle", "agents": [
        {"id": 2, "error_m": 0.01, "error_px": 3, "largest_jump_m": 0.002},
        {"id": 3, "error_m": 0.02, "error_px": 4, "largest_jump_m": 0.001}]},
      {"name": "pot", "agents": [{"id": 1, "error_m": 0.015, "error_px": 2, "largest_jump_m": 0}]}],
    "fused_at": [
      {"change": "fused", "session_s": 10.5, "agents": [2], "map_ids": ["2/10", "2/20"]},
      {"change": "fused", "session_s": 20.5, "agents": [1, 2], "map_ids": ["1/10", "2/10", "2/20"]},
      {"change": "taken apart", "session_s": 25.5, "agents": [1], "map_ids": ["1/10"]},
      {"change": "fused", "session_s": 30.5, "agents": [1, 2], "map_ids": ["1/10", "2/10", "2/20"]},
      {"change": "fused", "session_s": 40.5, "agents": [1, 2],
       "map_ids": ["1/10", "1/20", "2/10", "2/20"]}]})");
}

CheckedExpectation Only(const Expectations& expectations, const ordered_json& report) {
  const std::vector<CheckedExpectation> checked = Check(expectations, report);
  EXPECT_EQ(checked.size(), 1u);
  return checked.at(0);
}

bool Met(const std::string& name, double bound, const ordered_json& report = Report()) {
  return Only({{name, bound}}, report).met;
}

TEST(Expectations, BoundsAreOnEitherSide) {
  EXPECT_TRUE(Met("groups", 1));
  EXPECT_FALSE(Met("groups", 2));
  EXPECT_TRUE(Met("ate_joint_m", 0.05));
  EXPECT_FALSE(Met("ate_joint_m", 0.04));
  EXPECT_TRUE(Met("ate_vio_m", 0.04));
  EXPECT_FALSE(Met("ate_vio_m", 0.035));
  EXPECT_TRUE(Met("coverage", 0.7));
  EXPECT_FALSE(Met("coverage", 0.95));
  EXPECT_TRUE(Met("maps", 2));
  EXPECT_FALSE(Met("maps", 1));
  EXPECT_TRUE(Met("wrong_constraints", 1));
  EXPECT_FALSE(Met("wrong_constraints", 0));
}

TEST(Expectations, FusedIsForGood) {
  EXPECT_TRUE(Met("fused_by", 30.5));
  EXPECT_FALSE(Met("fused_by", 30));
  ordered_json apart = Report();
  apart["groups"] = {{{"agents", {1}}}, {{"agents", {2}}}};
  EXPECT_FALSE(Met("fused_by", 1000, apart));
}

// A session that continues a journal is fused with the maps of agents that it does not have.
TEST(Expectations, AgentsOfEarlierSessionsMayBeInTheGroup) {
  ordered_json report = Report();
  report["groups"] = {{{"agents", {1, 2, 7}}}};
  report["fused_at"].back()["map_ids"].push_back("7/1");
  EXPECT_TRUE(Met("fused_by", 30.5, report));
  report["groups"] = {{{"agents", {1, 7}}}, {{"agents", {2}}}};
  EXPECT_FALSE(Met("fused_by", 1000, report));
}

// The same agent's map of an earlier session does not count for it.
TEST(Expectations, AnAgentsEarlierMapDoesNotStandForIt) {
  ordered_json report = Report();
  ordered_json& first = report["agents"][0];
  first["map_ids"] = {"1/10", "1/20"};
  first["map_ids_not_compared"] = {"1/10"};
  EXPECT_TRUE(Met("maps", 2, report));
  report["agents"][1]["map_ids_not_compared"] = {"2/10"};
  EXPECT_TRUE(Met("maps", 1, report));
  EXPECT_FALSE(Met("fused_by", 40, report)) << "until 40.5 s only the earlier map is in the group";
  EXPECT_TRUE(Met("fused_by", 40.5, report));
}

// The report has one change for a split, of either part.
TEST(Expectations, AMapMayLeaveWhileItsAgentStays) {
  for (const char* left : {R"({"agents": [2], "map_ids": ["2/20"]})",
                           R"({"agents": [1, 2], "map_ids": ["1/10", "2/10"]})"}) {
    ordered_json report = Report();
    ordered_json split = ordered_json::parse(left);
    split["change"] = "taken apart";
    split["session_s"] = 50.5;
    report["fused_at"].push_back(split);
    EXPECT_TRUE(Met("fused_by", 30.5, report)) << left;
  }
}

TEST(Expectations, AMetricThatIsNotThereMisses) {
  const CheckedExpectation server = Only({{"ate_server_m", 1}}, Report());
  EXPECT_FALSE(server.met);
  EXPECT_EQ(server.value, "agent 1: 0.02 m, agent 2: no value");
  ordered_json nothing = Report();
  nothing["agents"] = ordered_json::array();
  nothing["groups"] = ordered_json::array();
  nothing["ate_joint_m"] = nullptr;
  nothing["constraints_truth"] = {{"checked", 0}, {"wrong", 0}};
  for (const char* name : {"ate_joint_m", "wrong_constraints", "fused_by", "maps", "coverage"}) {
    EXPECT_FALSE(Met(name, 1, nothing)) << name;
  }
  // "none" would read as if there were no wrong ones.
  EXPECT_EQ(Only({{"wrong_constraints", 0}}, nothing).value, "no value");
}

TEST(Expectations, TheWorstAnchorCounts) {
  EXPECT_TRUE(Met("anchor_error_m", 0.02));
  EXPECT_FALSE(Met("anchor_error_m", 0.019));
  EXPECT_TRUE(Met("anchor_largest_jump_m", 0.002));
  EXPECT_FALSE(Met("anchor_largest_jump_m", 0.0015));
  const CheckedExpectation pixels = Only({{"anchor_error_px", 4}}, Report());
  EXPECT_TRUE(pixels.met);
  EXPECT_EQ(pixels.value, "kettle at agent 2: 3 px, kettle at agent 3: 4 px, pot at agent 1: 2 px");
}

TEST(Expectations, AnAnchorThatIsNotShownMissesAndOneThatIsNotLookedAtDoesNot) {
  ordered_json report = Report();
  ordered_json& third = report["anchors"][0]["agents"][1];
  third["error_px"] = nullptr;
  EXPECT_TRUE(Met("anchor_error_px", 3, report));
  third["error_m"] = nullptr;
  for (const char* name : {"anchor_error_px", "anchor_error_m"}) {
    EXPECT_FALSE(Met(name, 1000, report)) << name;
  }
  ordered_json alone = Report();
  alone["anchors"][1]["agents"] = ordered_json::array();
  EXPECT_EQ(Only({{"anchor_error_m", 1}}, alone).value,
            "kettle at agent 2: 0.01 m, kettle at agent 3: 0.02 m, pot: no value");
  EXPECT_FALSE(Met("anchor_error_m", 1, alone));
  alone["anchors"] = ordered_json::array();
  EXPECT_FALSE(Met("anchor_error_m", 1, alone));
}

TEST(Expectations, AreShownWithTheirValues) {
  const auto checked = Check({{"fused_by", 40}, {"coverage", 0.9}}, Report());
  const std::string text = ToTable(checked).Text();
  EXPECT_THAT(text, HasSubstr("| fused_by | at most 40 s "));
  EXPECT_THAT(text, HasSubstr("30.5 s"));
  EXPECT_THAT(text, HasSubstr("agent 1: 0.99, agent 2: 0.7 | MISSED"));
  const ordered_json json = ToJson(checked);
  ASSERT_EQ(json.size(), 2u);
  EXPECT_EQ(json[0]["name"], "fused_by");
  EXPECT_EQ(json[0]["met"], true);
  EXPECT_EQ(json[1]["met"], false);
}

Expectations Read(const std::string& text) {
  YamlOptions yaml;
  const ExpectationsSection section(yaml, "expect");
  yaml.ReadText(text, "a.yaml");
  return section.Take();
}

TEST(Expectations, AreReadFromASessionFile) {
  EXPECT_TRUE(Read("").empty());
  EXPECT_THAT(Read("expect: {fused_by: 40, groups: 0}"),
              ElementsAre(std::pair("fused_by", 40), std::pair("groups", 0)));
  for (const char* bad : {"-1", ".nan", ".inf"}) {
    try {
      Read(std::string("expect: {fused_by: ") + bad + "}");
      FAIL() << bad << " was taken";
    } catch (const std::runtime_error& error) {
      EXPECT_THAT(error.what(), HasSubstr("a.yaml:1: key 'expect.fused_by'"));
    }
  }
}

}  // namespace
}  // namespace pangea
