#include "gateway/join_request.h"

#include <sodium.h>

#include <cctype>
#include <nlohmann/json.hpp>

#include "core/text/control_characters.h"

namespace pangea {
namespace {

using nlohmann::json;

constexpr std::string_view kLetters = "0123456789ABCDEFGHJKMNPQRSTVWXYZ";
constexpr size_t kGroup = 4;

char PlainLetter(char c) {
  const char upper = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  switch (upper) {
    case 'O':
      return '0';
    case 'I':
    case 'L':
      return '1';
    default:
      return upper;
  }
}

}  // namespace

std::string NewJoinCode() {
  std::string code;
  for (size_t i = 0; i < kCodeLetters; ++i) {
    code += i > 0 && i % kGroup == 0 ? "-" : "";
    code += kLetters[randombytes_uniform(static_cast<uint32_t>(kLetters.size()))];
  }
  return code;
}

std::string PlainJoinCode(std::string_view text) {
  std::string code;
  for (const char c : text) {
    if (c == '-' || c == ' ') {
      continue;
    }
    const char letter = PlainLetter(c);
    if (kLetters.find(letter) == std::string_view::npos || code.size() == kCodeLetters) {
      return "";
    }
    code += letter;
  }
  return code.size() == kCodeLetters ? code : "";
}

bool IsVisitorName(std::string_view text) {
  // dump() throws if the text is not UTF-8.
  const auto is_utf8 = [&] {
    try {
      return !json(text).dump().empty();
    } catch (const json::exception&) {
      return false;
    }
  };
  return text.size() <= kMaxVisitorName && !HasControlCharacter(text) && is_utf8();
}

std::variant<JoinRequest, std::string> ParseJoinRequest(std::string_view body) {
  const json parsed = json::parse(body, nullptr, false);
  if (!parsed.is_object()) {
    return R"(The request is no JSON object: {"code": "ABCD-EFGH-JKMN-PQRS", "name": "Anna"}.)";
  }
  JoinRequest request;
  for (const auto& [field, value] : parsed.items()) {
    if ((field != "code" && field != "name") || !value.is_string()) {
      return "The request has \"code\" and \"name\", both texts, and nothing else.";
    }
    (field == "code" ? request.code : request.name) = value.get<std::string>();
  }
  request.code = PlainJoinCode(request.code);
  if (request.code.empty()) {
    return "This is no code: it has 16 letters and digits, as ABCD-EFGH-JKMN-PQRS.";
  }
  if (!IsVisitorName(request.name)) {
    return "The name is too long, or has signs that cannot be shown.";
  }
  return request;
}

}  // namespace pangea
