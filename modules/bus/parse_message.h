#pragma once

// Bytes of a bus or a log as a domain type, or refused with the reason.

#include <optional>
#include <string>

#include "bus/bus.h"

namespace pangea {

// Of an lcm-gen type for which there is a Parse.
template <typename Message>
auto ParseMessage(Bytes data) -> decltype(Parse(Message{})) {
  Message message{};
  if (!DecodeMessage(data, &message)) {
    return {std::nullopt, std::string(Message::getTypeName()) + " does not decode"};
  }
  return Parse(message);
}

}  // namespace pangea
