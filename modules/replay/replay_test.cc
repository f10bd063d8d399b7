#include "replay/replay.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sstream>

namespace pangea::session {
namespace {

using testing::EndsWith;
using testing::HasSubstr;

const std::filesystem::path kSample =
    std::filesystem::path(PANGEA_SOURCE_DIR) / "logs" / "two_walks" / "session.lcm";
constexpr double kUntil_s = 3;

// What is told of a replay in which nothing takes less than ten seconds.
template <typename Run>
std::string Told(Run run) {
  std::ostringstream out;
  double now_s = 0;
  Progress progress("replay", out, false, [&now_s] { return now_s += 10; });
  run(progress);
  return out.str();
}

TEST(Replay, TellsHowFarItIs) {
  const std::string log = testing::TempDir() + "replay_progress.lcm";
  int64_t keyframes = 0;
  const std::string whole = Told([&](Progress& progress) {
    keyframes = Replay({kSample}, {}, kUntil_s, log, progress).keyframes;
  });
  ASSERT_GT(keyframes, 1);
  EXPECT_THAT(whole, HasSubstr(fmt::format("replay: 1 of {0} keyframes\n", keyframes)));
  EXPECT_THAT(whole, EndsWith(fmt::format("replay: {0} of {0} keyframes\n", keyframes)));
  ReplayedPart posegraph;
  posegraph.processes = {"posegraph"};
  const std::string part =
      Told([&](Progress& progress) { ReplayPart(log, posegraph, log + ".part", progress); });
  EXPECT_THAT(part, HasSubstr("replay: 1 of "));
  EXPECT_THAT(part, EndsWith(" messages\n"));
  std::filesystem::remove(log);
  std::filesystem::remove(log + ".part");
}

}  // namespace
}  // namespace pangea::session
