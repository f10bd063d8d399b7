#pragma once

// The two message types of KEYFRAME_k as one: keyframe_t, and keyframe_2_t, which has more fields.
// Decodes both. Encodes keyframe_t unless one of the additional fields is set, so that keyframes
// without them keep the bytes of earlier versions.

#include <cstdint>

#include "pangea/keyframe_t.hpp"

namespace pangea {

// Has the functions of an lcm-gen type.
struct KeyframeMessage : keyframe_t {
  // The additional fields of keyframe_2_t.
  double scale_sigma = 0;
  double T_body_cam_covariance[36] = {};

  // Whether the eight bytes from `begin` on are the fingerprint of one of the two types.
  static bool BeginsOne(const uint8_t* begin);

  int encode(void* buf, int offset, int maxlen) const;
  int decode(const void* buf, int offset, int maxlen);
  int getEncodedSize() const;

 private:
  bool SaysMore() const;
};

}  // namespace pangea
