#pragma once

// KEYFRAME_k's two types as one: keyframe_t, and keyframe_2_t where there is something to say that
// the former cannot. Decodes both; encodes the former where that is enough, so that what was
// written before keeps its bytes.

#include <cstdint>

#include "pangea/keyframe_t.hpp"

namespace pangea {

// With the functions of an lcm-gen type.
struct KeyframeMessage : keyframe_t {
  // As in keyframe_2_t.
  double scale_sigma = 0;
  double T_body_cam_covariance[36] = {};

  // Whether the bytes begin as one of the two does.
  static bool BeginsOne(const uint8_t* begin);

  int encode(void* buf, int offset, int maxlen) const;
  int decode(const void* buf, int offset, int maxlen);
  int getEncodedSize() const;

 private:
  bool SaysMore() const;
};

}  // namespace pangea
