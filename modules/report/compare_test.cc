#include "report/compare.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

namespace pangea {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using testing::AllOf;
using testing::HasSubstr;

class Compare : public ::testing::Test {
 protected:
  void SetUp() override { fs::remove_all(folder_); }
  fs::path Write(const std::string& run, const json& report) {
    fs::create_directories(folder_ / run);
    std::ofstream(folder_ / run / "report.json") << report;
    return folder_ / run;
  }
  static json Report(int accepted) {
    return {{"constraints", {{"accepted", accepted}, {"refused", 10}}},
            {"constraints_truth", {{"checked", 0}, {"wrong", 0}, {"nees_per_dim", nullptr}}},
            {"ate_joint_m", nullptr},
            {"groups", json::array({json::object()})},
            {"notes", json::array({"agent 1: no recording is known, so no error"})}};
  }
  const fs::path folder_ = fs::path(testing::TempDir()) / "compare";
};

TEST_F(Compare, OneRowEachAndTheOptionsBelow) {
  const fs::path plain = Write("plain", Report(55));
  json report = Report(40);
  report["constraints_truth"] = {{"checked", 40}, {"wrong", 1}, {"nees_per_dim", {{"mean", 1.25}}}};
  report["ate_joint_m"] = 0.0519;
  report["groups"].push_back(json::object());
  report["notes"].push_back("option fusion.alignment.min_inliers 30 (default 16)");
  const fs::path strict = Write("strict", report);
  WriteTiming(12.34, strict);
  const std::string text = CompareRuns({plain, strict / "report.json"});
  EXPECT_THAT(text, testing::ContainsRegex(
                        "plain +\\| +55 +\\| +10 +\\| - +\\| - +\\| - +\\| +1 +\\| - +\\|"));
  EXPECT_THAT(text, testing::ContainsRegex(
                        "report.json +\\| +40 +\\| +10 +\\| 1 of 40 +\\| +1.25 +\\| +0.0519 +\\| "
                        "+2 +\\| +12.3 +\\|"));
  EXPECT_THAT(text, HasSubstr("option fusion.alignment.min_inliers 30 (default 16)\n"));
}

TEST_F(Compare, WhatHasNoReportIsNamed) {
  const auto complaint = [](const fs::path& run) -> std::string {
    try {
      CompareRuns({run});
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return "taken";
  };
  fs::create_directories(folder_ / "empty");
  EXPECT_THAT(complaint(folder_ / "empty"), HasSubstr("no report here"));
  std::ofstream(folder_ / "session.lcm") << "log";
  EXPECT_THAT(complaint(folder_ / "session.lcm"),
              AllOf(HasSubstr("no report.json"), HasSubstr("pangea-session report")));
  EXPECT_THAT(complaint(Write("other", json::object())), HasSubstr("no report of this version"));
}

}  // namespace
}  // namespace pangea
