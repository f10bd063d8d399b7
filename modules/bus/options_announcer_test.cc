#include "bus/options_announcer.h"

#include <gtest/gtest.h>

#include "messages/encoding.h"
#include "pangea/options_t.hpp"

namespace pangea {
namespace {

TEST(OptionsAnnouncer, SaysAtOnceAndAgainForWhoComesLater) {
  LocalBus bus;
  std::vector<options_t> said;
  bus.Subscribe("OPTIONS_fusion", [&said](const std::string&, Bytes data) {
    ASSERT_TRUE(DecodeMessage(data, &said.emplace_back()));
  });
  OptionsAnnouncer announcer(bus, "fusion", "min_inliers: 20\n");
  constexpr int64_t kStart = 1'000'000'000;
  for (int64_t elapsed = 0; elapsed < 25'000'000; elapsed += 100'000) {
    announcer.Tick(kStart + elapsed);
    bus.Drain();
    ASSERT_FALSE(said.empty());
  }
  ASSERT_EQ(said.size(), 3U);
  EXPECT_EQ(said.back().process, "fusion");
  EXPECT_EQ(said.back().yaml, "min_inliers: 20\n");
  EXPECT_EQ(said.back().utime, kStart);  // of the start, so that a restart shows
}

}  // namespace
}  // namespace pangea
