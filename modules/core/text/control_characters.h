#pragma once

// Texts that people see, in UTF-8.

#include <string_view>

namespace pangea {

// Whether the text has a control character. U+0080 to U+009F, which some terminals obey, have two
// bytes.
bool HasControlCharacter(std::string_view text);

}  // namespace pangea
