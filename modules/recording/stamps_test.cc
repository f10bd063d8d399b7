// Tests what is said about time stamps: gaps, bursts, and another rate than the stated one.

#include "recording/stamps.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace pangea {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

std::vector<std::string> Warnings(const std::vector<int64_t>& utimes,
                                  const std::optional<double>& stated_hz = std::nullopt) {
  std::vector<std::string> warnings;
  NameStamps(utimes, 3.5, "data.csv", stated_hz, "sensor.yaml", &warnings);
  return warnings;
}

// `copies` more stamps, 1 ms apart, after each of `count` at 20 Hz.
std::vector<int64_t> Bursts(int count, int copies) {
  std::vector<int64_t> utimes;
  for (int i = 0; i < count; ++i) {
    for (int k = 0; k <= copies; ++k) {
      utimes.push_back(i * int64_t{50'000} + k * int64_t{1000});
    }
  }
  return utimes;
}

TEST(Stamps, RegularOnesAreNotRemarkedOn) {
  EXPECT_THAT(Warnings(Bursts(100, 0)), IsEmpty());
  EXPECT_THAT(Warnings(Bursts(100, 0), 20), IsEmpty());
  EXPECT_THAT(Warnings(Bursts(100, 0), 21.5), IsEmpty());
}

TEST(Stamps, CopiesAtOnceAreOneWarning) {
  for (const int copies : {1, 2, 5}) {
    const auto warnings = Warnings(Bursts(340, copies), 20);
    ASSERT_EQ(warnings.size(), 1U) << copies;
    EXPECT_THAT(warnings[0],
                HasSubstr(fmt::format("data.csv: {} of {} stamps follow the one before by 1 ms, in "
                                      "bursts 50 ms apart",
                                      340 * copies, 340 * (copies + 1))));
  }
}

TEST(Stamps, AGapAmongCopiesIsStillNamed) {
  std::vector<int64_t> utimes = Bursts(50, 1);
  for (size_t i = 60; i < utimes.size(); ++i) {
    utimes[i] += 1'000'000;
  }
  EXPECT_THAT(Warnings(utimes), ElementsAre(HasSubstr("bursts 50 ms apart"),
                                            HasSubstr("data.csv: gap of 1.049 s after 1.451 s")));
}

TEST(Stamps, GapsAreNamedAndCounted) {
  std::vector<int64_t> utimes;
  for (int i = 0; i < 200; ++i) {
    utimes.push_back(i * int64_t{50'000} + i / 25 * int64_t{400'000});
  }
  const auto warnings = Warnings(utimes);
  ASSERT_EQ(warnings.size(), 6U);
  EXPECT_EQ(warnings[0], "data.csv: gap of 0.450 s after 1.200 s");
  EXPECT_EQ(warnings[5], "data.csv: ... and 2 more gaps");
}

TEST(Stamps, AnotherRateThanTheStatedOneIsNamed) {
  EXPECT_THAT(Warnings(Bursts(100, 0), 30),
              ElementsAre(HasSubstr("sensor.yaml: states 30 Hz, but by their stamps the rows of "
                                    "data.csv come at 20 Hz")));
  EXPECT_THAT(Warnings(Bursts(5, 0), 30), IsEmpty()) << "too few";
}

}  // namespace
}  // namespace pangea
