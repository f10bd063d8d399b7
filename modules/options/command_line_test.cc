#include "options/command_line.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <stdexcept>
#include <string>
#include <system_error>

namespace pangea {
namespace {

namespace fs = std::filesystem;

std::string TextOf(const std::exception& error) {
  testing::internal::CaptureStderr();
  EXPECT_EQ(Failed("pangea-fusion", error), 1);
  return testing::internal::GetCapturedStderr();
}

TEST(Failed, SaysWhichProgramAndWhy) {
  EXPECT_EQ(TextOf(std::runtime_error("a.yaml:3: no")), "pangea-fusion: a.yaml:3: no\n");
}

TEST(Failed, AFileOrFolderThatCannotBeUsedIsNamedFirst) {
  const std::error_code denied = std::make_error_code(std::errc::permission_denied);
  EXPECT_EQ(TextOf(fs::filesystem_error("status", "/root/keys", denied)),
            "pangea-fusion: /root/keys: cannot be used: Permission denied; is it another user's? "
            "Get the right to it, or give another path\n");
  const std::error_code full = std::make_error_code(std::errc::no_space_on_device);
  EXPECT_EQ(TextOf(fs::filesystem_error("cannot rename", "a", "b", full)),
            "pangea-fusion: a, b: cannot be used: No space left on device\n");
}

TEST(Within, TakesFiniteNumbersInTheRangeAlone) {
  const CLI::Validator rate = Within(0.5, 4);
  const CLI::Validator rate_or_max = rate | CLI::IsMember({"max"});
  for (const std::string good : {"0.5", "1", "4"}) {
    EXPECT_EQ(rate(good), "") << good;
    EXPECT_EQ(rate_or_max(good), "") << good;
  }
  for (const std::string bad : {"0.4", "4.1", "nan", "-nan", "inf", "-inf", "x", ""}) {
    EXPECT_NE(rate(bad), "") << bad;
    EXPECT_NE(rate_or_max(bad), "") << bad;
  }
  EXPECT_EQ(rate_or_max("max"), "");
}

}  // namespace
}  // namespace pangea
