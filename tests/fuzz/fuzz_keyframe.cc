// keyframe_t, from bytes to the domain type.

#include "fuzz.h"
#include "messages/messages.h"

int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace pangea;
  std::vector<uint8_t> bytes(data, data + size);
  fuzz::SetFingerprint(keyframe_t::getHash(), &bytes);
  keyframe_t message{};
  if (!DecodeMessage(bytes, &message)) {
    return 0;
  }
  const Parsed<Keyframe> keyframe = Parse(message);
  fuzz::Require(keyframe.value.has_value() == keyframe.refused.empty(), "a refusal has a reason");
  if (keyframe.value) {
    const Parsed<Keyframe> again = Parse(ToMessage(*keyframe.value));
    fuzz::Require(again.value.has_value(), "what was accepted once is accepted again");
    fuzz::Require(again.value->corners.size() == keyframe.value->corners.size(), "corners stay");
  }
  return 0;
}
