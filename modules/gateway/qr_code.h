#pragma once

#include <string>

namespace pangea {

// A text as a QR code (ISO/IEC 18004) of block characters, two rows of modules a line, with the
// quiet zone around. Light modules are drawn: for a dark terminal; with `coloured` it sets both
// colours, for any. Throws std::runtime_error for a text that is too long.
std::string QrCode(const std::string& text, bool coloured);

}  // namespace pangea
