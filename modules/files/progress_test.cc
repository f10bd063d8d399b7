#include "files/progress.h"

#include <gtest/gtest.h>

#include <sstream>

namespace pangea {
namespace {

// 300 items, ten per second.
std::string Told(bool is_terminal) {
  std::ostringstream out;
  double now_s = 1000;
  {
    Progress progress("pangea-vio", out, is_terminal, [&] { return now_s; });
    for (int done = 1; done <= 300; ++done) {
      now_s += 0.1;
      progress.Update(done, 300, "images");
    }
  }
  return out.str();
}

TEST(Progress, NowAndThenALineInAFile) {
  EXPECT_EQ(Told(false),
            "pangea-vio: 20 of 300 images\npangea-vio: 120 of 300 images\n"
            "pangea-vio: 220 of 300 images\n");
}

TEST(Progress, OneLineOnATerminalThatIsTakenOff) {
  const std::string told = Told(true);
  EXPECT_EQ(told.find('\n'), std::string::npos);
  EXPECT_NE(told.find("\rpangea-vio: 150 of 300 images\033[K"), std::string::npos) << told;
  EXPECT_TRUE(told.ends_with("\r\033[K")) << told;
}

TEST(Progress, ACommandThatIsDoneAtOnceSaysNothing) {
  std::ostringstream out;
  {
    Progress progress("pangea-vio", out, true, [] { return 1.0; });
    progress.Update(1, 1, "images");
  }
  EXPECT_EQ(out.str(), "");
}

}  // namespace
}  // namespace pangea
