#pragma once

// Any of our messages, field by field, by the text of its type (lcmtypes/*.lcm): for tools that
// show messages or compare them, whatever the type.

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "bus/bus.h"

namespace pangea::session {

struct MessageField {
  std::string path;   // "candidates[0].score"
  std::string value;  // numbers as short as they read back the same; texts in quotes, as in JSON
};

struct DecodedMessage {
  std::string type;  // "place_match_t"
  std::vector<MessageField> fields;
};

// Nothing when the fingerprint is none of ours or the bytes do not fit the type. The fields of long
// arrays are as many as their items: a keyframe has some 25,000.
std::optional<DecodedMessage> DecodeFields(Bytes data);
// The message as the type nests it. A number that is none, or infinite, is null; a whole number of
// more than 53 bits is a text, for most readers of JSON would round it.
nlohmann::ordered_json ToJson(const DecodedMessage& message);
// The type alone.
std::optional<std::string> TypeOf(Bytes data);

}  // namespace pangea::session
