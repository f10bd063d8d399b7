// Pins the fingerprint of every type: a type that a committed log contains is frozen, and a change
// here must be intended. A changed type is a new file; only a type that was never released may have
// its number replaced.

#include <gtest/gtest.h>

#include "pangea/again_t.hpp"
#include "pangea/anchor_edit_t.hpp"
#include "pangea/anchor_t.hpp"
#include "pangea/camera_t.hpp"
#include "pangea/checksums_t.hpp"
#include "pangea/constraint_t.hpp"
#include "pangea/correction_t.hpp"
#include "pangea/have_t.hpp"
#include "pangea/image_t.hpp"
#include "pangea/imu_t.hpp"
#include "pangea/journal_file_t.hpp"
#include "pangea/keyframe_2_t.hpp"
#include "pangea/keyframe_3_t.hpp"
#include "pangea/keyframe_4_t.hpp"
#include "pangea/keyframe_t.hpp"
#include "pangea/landmarks_t.hpp"
#include "pangea/map_state_t.hpp"
#include "pangea/options_t.hpp"
#include "pangea/others_t.hpp"
#include "pangea/place_match_t.hpp"
#include "pangea/pose_t.hpp"
#include "pangea/resend_request_t.hpp"
#include "pangea/shown_anchors_t.hpp"
#include "pangea/status_t.hpp"
#include "pangea/verdict_request_t.hpp"

namespace pangea {
namespace {

TEST(Fingerprints, ArePinned) {
  EXPECT_EQ(static_cast<uint64_t>(again_t::getHash()), 0x6f768b67d21c1586u);
  EXPECT_EQ(static_cast<uint64_t>(anchor_edit_t::getHash()), 0x91772b3888cb7d66u);
  EXPECT_EQ(static_cast<uint64_t>(anchor_t::getHash()), 0x7a574a839c8d38ddu);
  EXPECT_EQ(static_cast<uint64_t>(camera_t::getHash()), 0xe1fe7ec25d6f1ac5u);
  EXPECT_EQ(static_cast<uint64_t>(checksums_t::getHash()), 0x52fe142c43cbb67au);
  EXPECT_EQ(static_cast<uint64_t>(constraint_t::getHash()), 0x2730b9abbbf2e325u);
  EXPECT_EQ(static_cast<uint64_t>(correction_t::getHash()), 0xfb0f44cb33451099u);
  EXPECT_EQ(static_cast<uint64_t>(have_t::getHash()), 0x9f58b67f2b9e7c17u);
  EXPECT_EQ(static_cast<uint64_t>(image_t::getHash()), 0xcf3cd5c496fbbc4fu);
  EXPECT_EQ(static_cast<uint64_t>(imu_t::getHash()), 0x831ef36c48e5cf62u);
  EXPECT_EQ(static_cast<uint64_t>(journal_file_t::getHash()), 0x69e928d608c54eeeu);
  EXPECT_EQ(static_cast<uint64_t>(keyframe_t::getHash()), 0x59b338437f11086du);
  EXPECT_EQ(static_cast<uint64_t>(keyframe_2_t::getHash()), 0x1eb6373b1cc1ddb2u);
  EXPECT_EQ(static_cast<uint64_t>(keyframe_3_t::getHash()), 0x353f3c02c32f26c3u);
  EXPECT_EQ(static_cast<uint64_t>(keyframe_4_t::getHash()), 0x973ced6e2d9864a8u);
  EXPECT_EQ(static_cast<uint64_t>(landmarks_t::getHash()), 0xc37fda84c71fcf58u);
  EXPECT_EQ(static_cast<uint64_t>(map_state_t::getHash()), 0xb735441a70264ce5u);
  EXPECT_EQ(static_cast<uint64_t>(options_t::getHash()), 0x68b9878722173cbcu);
  EXPECT_EQ(static_cast<uint64_t>(others_t::getHash()), 0xb9186610703fc487u);
  EXPECT_EQ(static_cast<uint64_t>(place_match_t::getHash()), 0x5be9f82364c3b435u);
  EXPECT_EQ(static_cast<uint64_t>(pose_t::getHash()), 0xe48404a0f50b25c7u);
  EXPECT_EQ(static_cast<uint64_t>(resend_request_t::getHash()), 0x3f967c69b75046f2u);
  EXPECT_EQ(static_cast<uint64_t>(shown_anchors_t::getHash()), 0x608bec938752b558u);
  EXPECT_EQ(static_cast<uint64_t>(status_t::getHash()), 0xc86ad2441b54de87u);
  EXPECT_EQ(static_cast<uint64_t>(verdict_request_t::getHash()), 0x2c0625dca65827feu);
}

}  // namespace
}  // namespace pangea
