#pragma once

// Parses bytes from a bus or a log to a domain type, or refuses them with a reason.

#include <optional>
#include <string>

#include "bus/bus.h"

namespace pangea {

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
