#pragma once

// Encodes and decodes lcm-gen types, and parses them to domain types.

#include <cstdint>
#include <exception>
#include <optional>
#include <string>
#include <vector>

#include "core/bytes.h"

namespace pangea {

// Encodes an lcm-gen type.
template <typename Message>
std::vector<uint8_t> EncodeMessage(const Message& message) {
  std::vector<uint8_t> bytes(static_cast<size_t>(message.getEncodedSize()));
  message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  return bytes;
}

// Decodes an lcm-gen type. False on a wrong fingerprint, a payload that is too short or too long,
// or absurd counts. (LCM's own typed subscriptions would abort the process.)
template <typename Message>
bool DecodeMessage(Bytes data, Message* message) {
  try {
    *message = Message{};
    return message->decode(data.data(), 0, static_cast<int>(data.size())) ==
           static_cast<int>(data.size());
  } catch (const std::exception&) {
    return false;
  }
}

// Parses bytes to a domain type, or refuses them with a reason.
// `Message`: an lcm-gen type that has a Parse function.
template <typename Message>
auto ParseMessage(Bytes data) -> decltype(Parse(Message{})) {
  Message message{};
  if (!DecodeMessage(data, &message)) {
    return {std::nullopt, std::string(Message::getTypeName()) + " does not decode"};
  }
  return Parse(message);
}

}  // namespace pangea
