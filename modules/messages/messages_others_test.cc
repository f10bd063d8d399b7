#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "messages/messages.h"

namespace pangea {
namespace {

Others SomeOthers() {
  Others others{{2, 200}, {}};
  for (int32_t i = 0; i < 16; ++i) {
    others.others.push_back({10 + i, {YawRotation(0.1 * i), {0.5 * i, 2, 1}}});
  }
  return others;
}

TEST(Others, RoundTrip) {
  const Others in = SomeOthers();
  const auto parsed = Parse(ToMessage(in));
  ASSERT_TRUE(parsed.value) << parsed.refused;
  EXPECT_EQ(parsed.value->map, in.map);
  ASSERT_EQ(parsed.value->others.size(), 16u);
  EXPECT_EQ(parsed.value->others[9].agent_id, 19);
  EXPECT_EQ(parsed.value->others[9].T_odom_cam.t, in.others[9].T_odom_cam.t);
}

TEST(Others, RefusesWhatIsHostile) {
  const auto refused = [](const std::function<void(others_t&)>& spoil) {
    others_t message = ToMessage(SomeOthers());
    spoil(message);
    return !Parse(message).value;
  };
  EXPECT_FALSE(refused([](others_t&) {}));
  EXPECT_TRUE(refused([](others_t& m) { m.map.agent_id = 0; }));
  EXPECT_TRUE(refused([](others_t& m) { m.num_others = -1; }));
  EXPECT_TRUE(refused([](others_t& m) { m.num_others = 17; }));
  EXPECT_TRUE(refused([](others_t& m) { m.others[3].agent_id = 0; }));
  EXPECT_TRUE(refused([](others_t& m) { m.others[3].agent_id = 65536; }));
  EXPECT_TRUE(refused([](others_t& m) { m.others[3].agent_id = 2; }));  // itself
  EXPECT_TRUE(refused([](others_t& m) { m.others[3].T_odom_cam.translation.x = NAN; }));
  EXPECT_TRUE(refused([](others_t& m) { m.others[3].T_odom_cam.rotation = {}; }));
}

}  // namespace
}  // namespace pangea
