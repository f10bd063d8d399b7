#include "server/agent_lines.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

namespace pangea {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

TEST(AgentLines, AreTheNewWholeLinesAboutAgents) {
  const std::filesystem::path log =
      std::filesystem::path(testing::TempDir()) / "agent_lines_agent_handler.txt";
  const auto add = [&log](const std::string& text) { std::ofstream(log, std::ios::app) << text; };
  std::filesystem::remove(log);
  EXPECT_THAT(AgentLines(log).Take(), IsEmpty()) << "there is no log yet";
  add("agent_handler: agent 1 has joined\n");
  AgentLines lines(log);
  EXPECT_THAT(lines.Take(), IsEmpty()) << "of an earlier run";
  add("pangea-agent-handler: started; bus udpm://...\n"
      "agent_handler: 2 agents, 0 keyframes in the journal\n"
      "agent_handler: agent 4 has joined\n"
      "agent_handler: agent 7 is ref");
  EXPECT_THAT(lines.Take(), ElementsAre("agent 4 has joined"));
  EXPECT_THAT(lines.Take(), IsEmpty());
  add("used: the folder of keys, keys, has no key for it\n");
  EXPECT_THAT(lines.Take(),
              ElementsAre("agent 7 is refused: the folder of keys, keys, has no key for it"));
  std::filesystem::resize_file(log, 0);
  add("agent_handler: agent 5 has joined\n");
  EXPECT_THAT(lines.Take(), ElementsAre("agent 5 has joined"));
}

}  // namespace
}  // namespace pangea
