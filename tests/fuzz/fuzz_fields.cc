// Any message, decoded by the text of its type, as in the tools that list and compare logs. The
// first byte selects the type.

#include <map>

#include "fuzz.h"
#include "log_tools/message_fields.h"
#include "messages/encoding.h"
#include "pangea_schemas.h"

namespace pangea::fuzz {
namespace {

template <typename Message>
bool Decodes(Bytes bytes) {
  Message message{};
  return DecodeMessage(bytes, &message);
}

// lcm-gen's decoders by fingerprint.
template <typename... Messages>
std::map<int64_t, bool (*)(Bytes)> DecodersOf() {
  return {{Messages::getHash(), Decodes<Messages>}...};
}

}  // namespace
}  // namespace pangea::fuzz

static int FuzzFields(const uint8_t* data, size_t size) {
  using namespace pangea;
  static const std::vector<LcmSchema> schemas = LcmSchemas();
  static const auto decoders =
      fuzz::DecodersOf<again_t, anchor_edit_t, anchor_t, camera_t, constraint_t, correction_t,
                       have_t, image_t, keyframe_t, keyframe_2_t, keyframe_3_t, keyframe_4_t,
                       landmarks_t, map_state_t, others_t, place_match_t, resend_request_t,
                       shown_anchors_t, status_t, verdict_request_t>();
  if (size == 0) {
    return 0;
  }
  const int64_t fingerprint = schemas[data[0] % schemas.size()].fingerprint;
  std::vector<uint8_t> bytes(data + 1, data + size);
  fuzz::SetFingerprint(fingerprint, &bytes);
  const auto message = DecodeFields(bytes);
  if (const auto decodes = decoders.find(fingerprint); decodes != decoders.end()) {
    fuzz::Require(decodes->second(bytes) == message.has_value(), "the fields are lcm-gen's");
  }
  if (message) {
    fuzz::Require(TypeOf(bytes) == message->type, "what decodes has a type");
    fuzz::Require(message->fields.size() <= bytes.size(), "no field without a byte");
    fuzz::Require(!ToJson(*message).dump().empty(), "texts are UTF-8");
  }
  return 0;
}
static const pangea::fuzz::Target kFields("fields", FuzzFields);
