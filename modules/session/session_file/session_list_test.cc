#include "session/session_file/session_list.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "session/session_file/session_file.h"

namespace pangea::session {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

// The repository's sessions conform to the schema.
TEST(SessionList, EveryShippedSessionParses) {
  const std::vector<fs::path> files = SessionFiles(fs::path(PANGEA_SOURCE_DIR) / "sessions");
  EXPECT_GE(files.size(), 23u);
  for (const fs::path& file : files) {
    EXPECT_NO_THROW(ParseSessionFile(file)) << file;
  }
}

// The example on the page that explains the keys conforms to the schema.
TEST(SessionList, TheExampleOfTheDocumentationParses) {
  std::ifstream page(fs::path(PANGEA_SOURCE_DIR) / "docs" / "sessions.md");
  const fs::path file = fs::path(testing::TempDir()) / "documented.yaml";
  std::ofstream example(file);
  bool inside = false;
  for (std::string line; std::getline(page, line);) {
    if (line.starts_with("```")) {
      inside = line == "```yaml";
    } else if (inside) {
      example << line << "\n";
    }
  }
  example.close();
  const SessionScript script = ParseSessionFile(file);
  ASSERT_EQ(script.agents.size(), 4u);
  EXPECT_TRUE(script.agents[3].live);
  EXPECT_EQ(script.faults.size(), 3u);
  EXPECT_EQ(script.anchors.size(), 1u);
  EXPECT_EQ(script.expect.size(), 11u);
}

TEST(SessionList, TellsWhoIsInAndWhatIsMissing) {
  const fs::path folder = fs::path(testing::TempDir()) / "session_list";
  fs::remove_all(folder);
  fs::create_directories(folder / "recordings" / "here" / "mav0");
  std::ofstream(folder / "good.yaml")
      << "# What it shows.\nagents:\n  - {id: 1, recording: here, start: 5, duration: 10}\n"
         "  - {id: 2, recording: gone, delay: 3}\n"
         "anchors: [{agent: 1, at: 7, name: kettle, pixel: [3, 4]}]\n"
         "faults: [{at: 4, kill: fusion}, {at: 5, disconnect: 2}]\nexpect: {groups: 1}\n";
  std::ofstream(folder / "whole.yaml")
      << "agents: [{id: 7, recording: here}, {id: 8, live: true, duration: 60}]\n";
  std::ofstream(folder / "wrong.yaml") << "agent: [{id: 7, recording: here}]\n";
  std::ofstream(folder / "no_session.txt") << "";
  const std::vector<fs::path> files = SessionFiles(folder);
  ASSERT_EQ(files.size(), 3u);
  EXPECT_THAT(
      DescribeSessions({files[0]}, folder / "recordings"),
      AllOf(HasSubstr("good.yaml: What it shows.\n"), HasSubstr("agent 1: here from 5 s to 15 s\n"),
            HasSubstr("agent 2: gone, after 3 s\n"), HasSubstr("kill fusion at 4 s\n"),
            HasSubstr("agent 1 places kettle at 7 s of its recording\n"),
            HasSubstr("agent 2 disconnected from 5 s to 15 s\n"), HasSubstr("expects groups 1\n"),
            HasSubstr("missing: agent 2: recording "), Not(HasSubstr("missing: agent 1"))));
  EXPECT_THAT(DescribeSessions({files[1]}, folder / "recordings"),
              AllOf(HasSubstr("whole.yaml\n"), HasSubstr("agent 8: live, 60 s\n"),
                    HasSubstr("all of it is at hand")));
  EXPECT_THAT(DescribeSessions({files[2]}, std::nullopt),
              AllOf(HasSubstr("cannot be run"), HasSubstr("did you mean 'agents'?")));
  EXPECT_TRUE(SessionFiles(folder / "nowhere").empty());
}

TEST(SessionList, FindsByName) {
  const fs::path before = fs::current_path();
  fs::current_path(PANGEA_SOURCE_DIR);
  EXPECT_EQ(FindSessionFile("demo"), fs::path("sessions/demo.yaml"));
  EXPECT_EQ(FindSessionFile("sessions/demo.yaml"), fs::path("sessions/demo.yaml"));
  try {
    FindSessionFile("dmeo");
    ADD_FAILURE() << "was found";
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(),
                AllOf(HasSubstr("dmeo: is no file"), HasSubstr("did you mean 'demo'")));
  }
  fs::current_path(before);
}

}  // namespace
}  // namespace pangea::session
