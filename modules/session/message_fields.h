#pragma once

// Any of our messages, field by field, by the text of its type (lcmtypes/*.lcm): for tools that
// show messages or compare them, whatever the type.

#include <optional>
#include <string>
#include <vector>

#include "common/bus/bus.h"

namespace pangea::session {

struct MessageField {
  std::string path;   // "candidates[0].score"
  std::string value;  // numbers as short as they read back the same
};

struct DecodedMessage {
  std::string type;  // "place_match_t"
  std::vector<MessageField> fields;
};

// Nothing when the fingerprint is none of ours or the bytes do not fit the type. The fields of long
// arrays are as many as their items: a keyframe has some 25,000.
std::optional<DecodedMessage> DecodeFields(Bytes data);
// The type alone.
std::optional<std::string> TypeOf(Bytes data);

}  // namespace pangea::session
