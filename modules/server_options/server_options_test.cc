#include "server_options/server_options.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <optional>

#include "log_file/log_writer.h"
#include "messages/channels.h"
#include "messages/encoding.h"
#include "options/yaml_options.h"
#include "pangea/options_t.hpp"

namespace pangea {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

std::string Print(ServerOptions options) {
  YamlOptions yaml;
  options.Visit(yaml);
  return yaml.Print();
}

// Why it is refused.
std::string Complaint(const std::vector<std::string>& values, const std::string& file = "") {
  ServerOptions options;
  try {
    Override(file, values, &options);
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "taken";
}

class LogWithOptions {
 public:
  explicit LogWithOptions(const std::string& name)
      : path_(testing::TempDir() + "/" + name), log_(std::in_place, path_) {}
  ~LogWithOptions() { std::filesystem::remove(path_); }
  void Say(const std::string& process, const std::string& yaml) {
    options_t message{};
    message.process = process;
    message.yaml = yaml;
    log_->Write(++utime_, channels::Options(process), EncodeMessage(message));
  }
  // No more is said.
  std::filesystem::path Close() {
    log_.reset();
    return path_;
  }

 private:
  std::string path_;
  std::optional<LogFileWriter> log_;
  int64_t utime_ = 0;
};

// Of a log in which one process says this.
LoggedOptions ReadLogOf(const std::string& process, const std::string& yaml) {
  LogWithOptions log("one_process.lcm");
  log.Say(process, yaml);
  return ReadLoggedOptions({log.Close()});
}

TEST(ServerOptions, EveryDefaultIsWithinItsBoundsAndReadsBack) {
  ServerOptions options;
  options.fusion.alignment.min_inliers = 21;
  const std::string printed = Print(options);
  EXPECT_THAT(printed, HasSubstr("  # 4 to 100000: distinct landmarks\n"));
  ServerOptions back;
  YamlOptions yaml;
  back.Visit(yaml);
  yaml.ReadText(printed, "printed");
  EXPECT_EQ(Print(back), printed);
}

TEST(ServerOptions, WhatMakesNoSenseIsRefusedByNameAndRange) {
  EXPECT_THAT(Complaint({"fusion.alignment.min_inliers=0"}),
              HasSubstr("'fusion.alignment.min_inliers' must be a whole number from 4 to 100000, "
                        "not '0'"));
  for (const char* value :
       {"inter_map_ba.alignment.ba.iterations=0", "posegraph.local_keyframes=0",
        "global_ba.ba.max_iterations=0", "anchors.max_near=257",
        "place_recognition.max_keyframes=0", "fusion.alignment.max_sigma_m=.nan"}) {
    EXPECT_THAT(Complaint({value}), HasSubstr("must be a ")) << value;
  }
}

TEST(ServerOptions, AnUnknownNameIsRefusedWithTheNearest) {
  EXPECT_THAT(Complaint({"fusion.alignment.min_inlier=20"}),
              HasSubstr("did you mean 'fusion.alignment.min_inliers'?"));
  EXPECT_THAT(Complaint({"fusion.min_inliers=20"}),
              HasSubstr("did you mean 'fusion.alignment.min_inliers'?"));
  EXPECT_THAT(Complaint({"fuson.alignment.min_inliers=20"}), HasSubstr("did you mean 'fusion"));
  EXPECT_THAT(Complaint({"fusion.alignment=20"}), HasSubstr("no option 'fusion.alignment'"));
  EXPECT_THAT(Complaint({"fusion"}), HasSubstr("must be process.key=value"));
}

TEST(ServerOptions, ValuesGoOverTheFile) {
  const std::string file = testing::TempDir() + "/server_options.yaml";
  std::ofstream(file) << "fusion:\n  alignment: {min_inliers: 20, min_found: 11}\n";
  ServerOptions options;
  Override(file, {"fusion.alignment.min_inliers=30", "posegraph.scope=paper"}, &options);
  EXPECT_EQ(options.fusion.alignment.min_inliers, 30);
  EXPECT_EQ(options.fusion.alignment.min_found, 11);
  EXPECT_THAT(OtherThanDefault(options), ElementsAre("fusion.alignment.min_found 11 (default 10)",
                                                     "fusion.alignment.min_inliers 30 (default 16)",
                                                     "posegraph.scope paper (default all)"));
  std::ofstream(file) << "fusion:\n  alignment:\n    min_inliers: 0\n";
  EXPECT_THAT(Complaint({}, file),
              AllOf(HasSubstr("server_options.yaml:3"), HasSubstr("min_inliers")));
}

TEST(ServerOptions, TheNewestOfALogIsInForce) {
  LogWithOptions log("newest.lcm");
  log.Say("fusion", "alignment: {min_inliers: 20}");
  log.Say("vio_1", "estimator: {window: 9}");  // no server process
  log.Say("fusion", "alignment: {min_inliers: 25}");
  const LoggedOptions logged = ReadLoggedOptions({log.Close()});
  EXPECT_EQ(logged.options.fusion.alignment.min_inliers, 25);
  ASSERT_EQ(logged.notes.size(), 1U);
  EXPECT_THAT(logged.notes.front(), AllOf(HasSubstr("global_ba"), Not(HasSubstr("fusion")),
                                          HasSubstr("defaults, as the log has none")));
}

TEST(ServerOptions, WhatAProcessTellsReadsBack) {
  ServerOptions options;
  options.global_ba.local.keyframes = 44;
  options.posegraph.scope = PoseGraphOptions::Scope::kPaper;
  LogWithOptions log("told.lcm");
  for (const auto& [process, text] : TextsByProcess(options)) {
    EXPECT_LT(text.size(), 16'000U) << process;
    log.Say(process, text);
  }
  const LoggedOptions logged = ReadLoggedOptions({log.Close()});
  EXPECT_EQ(Print(logged.options), Print(options));
  EXPECT_THAT(logged.notes, IsEmpty());
}

TEST(ServerOptions, UnknownKeysOfALogAreLeftOutAndNamed) {
  const LoggedOptions logged = ReadLogOf("fusion", "alignment: {min_inliers: 20, of_last_year: 1}");
  EXPECT_EQ(logged.options.fusion.alignment.min_inliers, 20);
  ASSERT_EQ(logged.notes.size(), 2U);
  EXPECT_THAT(logged.notes.front(), AllOf(HasSubstr("fusion"), HasSubstr("of_last_year 1")));
}

TEST(ServerOptions, UnreadableOptionsOfALogAreDefaultsWithANote) {
  const LoggedOptions logged = ReadLogOf("fusion", "alignment: {min_inliers: 20, min_found: many}");
  EXPECT_EQ(logged.options.fusion.alignment.min_inliers, 16);
  ASSERT_EQ(logged.notes.size(), 2U);
  EXPECT_THAT(logged.notes.front(), AllOf(HasSubstr("fusion"), HasSubstr("min_found")));
}

TEST(ServerOptions, ALogWithoutAnyGivesDefaultsWithANote) {
  const LoggedOptions logged = ReadLogOf("vio_1", "estimator: {window: 9}");
  ASSERT_EQ(logged.notes.size(), 1U);
  EXPECT_THAT(logged.notes.front(), AllOf(HasSubstr("fusion"), HasSubstr("the log has none")));
}

}  // namespace
}  // namespace pangea
