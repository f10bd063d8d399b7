#pragma once

#include <string>

namespace pangea {

// A text as a QR code (ISO/IEC 18004) in block characters, with two rows of modules per line and
// the quiet zone. Light modules are drawn, which suits a dark terminal; with `coloured`, both
// colours are set, which suits any terminal. Throws std::runtime_error if the text is too long.
std::string QrCode(const std::string& text, bool coloured);

}  // namespace pangea
