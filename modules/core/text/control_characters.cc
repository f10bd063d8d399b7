#include "core/text/control_characters.h"

#include <algorithm>

namespace pangea {

bool HasControlCharacter(std::string_view text) {
  const auto is_control = [](unsigned char c) { return c < 0x20 || c == 0x7f; };
  const auto is_pair = [](unsigned char a, unsigned char b) {
    return a == 0xc2 && b >= 0x80 && b <= 0x9f;
  };
  return std::any_of(text.begin(), text.end(), is_control) ||
         std::adjacent_find(text.begin(), text.end(), is_pair) != text.end();
}

}  // namespace pangea
