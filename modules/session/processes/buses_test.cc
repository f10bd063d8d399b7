#include "session/processes/buses.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <numeric>
#include <set>
#include <stdexcept>

#include "session/processes/open_files.h"
#include "session/session_file/session_file.h"

namespace pangea::session {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

TEST(Buses, OfTheLargestSessionHaveAPortEach) {
  std::vector<int32_t> ids(kMaxSessionAgents);
  std::iota(ids.begin(), ids.end(), 1);
  const Buses buses = ChooseBuses(ids, ids, std::nullopt);
  std::set<std::string> urls = {buses.server, buses.link};
  for (const int32_t id : ids) {
    urls.insert(buses.agents.at(id));
    urls.insert(buses.agent_links.at(id));
  }
  EXPECT_EQ(urls.size(), 2 + 2 * kMaxSessionAgents);
}

TEST(Buses, DoNotGoBeyondTheLastPort) {
  EXPECT_THAT(([] {
                ChooseBuses({1, 2}, {}, 65533);
              }),
              ThrowsMessage<std::runtime_error>(HasSubstr("needs 4 UDP ports")));
}

class OpenFilesTest : public testing::Test {
 protected:
  OpenFilesTest() { getrlimit(RLIMIT_NOFILE, &before_); }
  ~OpenFilesTest() override { setrlimit(RLIMIT_NOFILE, &before_); }
  rlimit before_{};
};

TEST_F(OpenFilesTest, AreAsManyAsTheHardLimitLets) {
  const rlimit custom{200, before_.rlim_max};
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &custom), 0);
  AllowOpenFiles(100);
  rlimit now{};
  getrlimit(RLIMIT_NOFILE, &now);
  EXPECT_EQ(now.rlim_cur, 200u);
  AllowOpenFiles(300);
  getrlimit(RLIMIT_NOFILE, &now);
  EXPECT_EQ(now.rlim_cur, 300u);
  EXPECT_THAT([&] { AllowOpenFiles(before_.rlim_max + 1); },
              ThrowsMessage<std::runtime_error>(HasSubstr("ulimit -Hn")));
}

}  // namespace
}  // namespace pangea::session
