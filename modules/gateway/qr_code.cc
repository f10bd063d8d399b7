#include "gateway/qr_code.h"

#include <fmt/format.h>
#include <qrencode.h>

#include <cerrno>
#include <cstring>
#include <memory>
#include <stdexcept>

namespace pangea {

std::string QrCode(const std::string& text, bool coloured) {
  const std::unique_ptr<QRcode, decltype(&QRcode_free)> code(
      QRcode_encodeString8bit(text.c_str(), 0, QR_ECLEVEL_L), QRcode_free);
  if (code == nullptr) {
    throw std::runtime_error(fmt::format("'{}' makes no QR code: {}", text, std::strerror(errno)));
  }
  constexpr int kQuiet = 4;
  const int width = code->width;
  const auto is_light = [&](int x, int y) {
    const bool inside = x >= 0 && x < width && y >= 0 && y < width;
    return !inside || (code->data[y * width + x] & 1) == 0;
  };
  constexpr const char* kBlocks[2][2] = {{" ", "▄"}, {"▀", "█"}};
  std::string drawn;
  for (int y = -kQuiet; y < width + kQuiet; y += 2) {
    drawn += coloured ? "\x1b[97;40m" : "";
    for (int x = -kQuiet; x < width + kQuiet; ++x) {
      drawn += kBlocks[is_light(x, y) ? 1 : 0][is_light(x, y + 1) ? 1 : 0];
    }
    drawn += coloured ? "\x1b[0m\n" : "\n";
  }
  return drawn;
}

}  // namespace pangea
