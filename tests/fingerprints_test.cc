// Every type's fingerprint, pinned: a type that a committed log contains is frozen, and a change here must be meant.
// A changed type is a new file; only a type that never shipped may have its number replaced.

#include <gtest/gtest.h>

#include "pangea/again_t.hpp"
#include "pangea/camera_t.hpp"
#include "pangea/constraint_t.hpp"
#include "pangea/correction_t.hpp"
#include "pangea/have_t.hpp"
#include "pangea/image_t.hpp"
#include "pangea/imu_t.hpp"
#include "pangea/keyframe_t.hpp"
#include "pangea/link_ack_t.hpp"
#include "pangea/link_packet_t.hpp"
#include "pangea/map_state_t.hpp"
#include "pangea/place_match_t.hpp"
#include "pangea/pose_t.hpp"
#include "pangea/resend_request_t.hpp"
#include "pangea/status_t.hpp"

namespace pangea {
namespace {

TEST(Fingerprints, ArePinned) {
}

}  // namespace
}  // namespace pangea
