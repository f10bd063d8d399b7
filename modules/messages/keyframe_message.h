#pragma once

// The message types of KEYFRAME_k as one: keyframe_t; keyframe_2_t to keyframe_4_t, which have more
// and more fields. Decodes all. Encodes the first one that has all fields which are set, so that
// keyframes without the additional ones keep the bytes of earlier versions.

#include <cstdint>
#include <vector>

#include "pangea/keyframe_t.hpp"
#include "pangea/tag_t.hpp"

namespace pangea {

// Has the functions of an lcm-gen type.
struct KeyframeMessage : keyframe_t {
  // The additional fields of keyframe_2_t.
  double scale_sigma = 0;
  double T_body_cam_covariance[36] = {};
  // The additional field of keyframe_3_t.
  int8_t descriptor_kind = 0;
  // The additional field of keyframe_4_t.
  std::vector<tag_t> tags;

  // Whether the eight bytes from `begin` on are the fingerprint of one of the types.
  static bool BeginsOne(const uint8_t* begin);

  int encode(void* buf, int offset, int maxlen) const;
  int decode(const void* buf, int offset, int maxlen);
  int getEncodedSize() const;

 private:
  // Calls use(message of the type that is encoded).
  template <typename Use>
  int WithType(Use use) const;
};

}  // namespace pangea
