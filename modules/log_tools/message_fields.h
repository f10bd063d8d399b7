#pragma once

// Decodes any message of this project field by field, using the text of its type (lcmtypes/*.lcm);
// for tools that show or compare messages of any type.

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "core/bytes.h"

namespace pangea {

struct MessageField {
  std::string path;   // "candidates[0].score"
  std::string value;  // numbers in the shortest exact form; strings in quotes, as in JSON
};

struct DecodedMessage {
  std::string type;  // "place_match_t"
  std::vector<MessageField> fields;
};

// Empty if the fingerprint is unknown or the bytes do not fit the type. Each item of an array is a
// field: a keyframe has about 25,000.
std::optional<DecodedMessage> DecodeFields(Bytes data);
// The message as nested JSON. NaN and infinity become null; an integer with more than 53 bits
// becomes a string, because most readers of JSON would round it.
nlohmann::ordered_json ToJson(const DecodedMessage& message);
// Only the type.
std::optional<std::string> TypeOf(Bytes data);

}  // namespace pangea
