#pragma once

#include <functional>
#include <stdexcept>
#include <string>

namespace pangea {

// What the reader says of bad input; empty if it takes it.
inline std::string Complaint(const std::function<void()>& read) {
  try {
    read();
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "";
}

}  // namespace pangea
