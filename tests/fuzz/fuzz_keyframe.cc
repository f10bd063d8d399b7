// A keyframe, from bytes to the domain type.

#include <array>

#include "fuzz.h"
#include "messages/encoding.h"
#include "messages/messages.h"
#include "pangea/keyframe_2_t.hpp"
#include "pangea/keyframe_3_t.hpp"
#include "pangea/keyframe_4_t.hpp"

static int FuzzKeyframe(const uint8_t* data, size_t size) {
  using namespace pangea;
  std::vector<uint8_t> bytes(data, data + size);
  const std::array<int64_t, 4> types = {keyframe_t::getHash(), keyframe_2_t::getHash(),
                                        keyframe_3_t::getHash(), keyframe_4_t::getHash()};
  fuzz::SetFingerprint(types[size > 0 ? data[size - 1] % types.size() : 0], &bytes);
  KeyframeMessage message{};
  if (!DecodeMessage(bytes, &message)) {
    return 0;
  }
  const Parsed<Keyframe> keyframe = Parse(message);
  fuzz::Require(keyframe.value.has_value() == keyframe.refused.empty(), "a refusal has a reason");
  if (keyframe.value) {
    const Parsed<Keyframe> again = Parse(ToMessage(*keyframe.value));
    fuzz::Require(again.value.has_value(), "what was accepted once is accepted again");
    fuzz::Require(again.value->corners.size() == keyframe.value->corners.size(), "corners stay");
    fuzz::Require(again.value->tags.size() == keyframe.value->tags.size(), "tags stay");
  }
  return 0;
}
static const pangea::fuzz::Target kKeyframe("keyframe", FuzzKeyframe);
