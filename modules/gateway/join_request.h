#pragma once

// The body of POST /v1/join, and the words that a code is made of. Past ParseJoinRequest both
// fields are bounded.

#include <string>
#include <string_view>
#include <variant>

namespace pangea {

// A code has 80 random bits: 16 of Crockford's 32 letters and digits, "ABCD-EFGH-JKMN-PQRS".
inline constexpr size_t kCodeLetters = 16;
std::string NewJoinCode();
// As it was made, whatever of case and dashes a person changed, and with the letters that look like
// digits taken for these; empty for what is no code.
std::string PlainJoinCode(std::string_view text);

struct JoinRequest {
  std::string code;  // plain
  std::string name;  // UTF-8 without control characters, at most 60 bytes; may be empty
};

inline constexpr size_t kMaxVisitorName = 60;
// What may stand for a person or a phone.
bool IsVisitorName(std::string_view text);

// Of {"code": TEXT, "name": TEXT}, the name may be left out; or what is wrong, for the visitor.
std::variant<JoinRequest, std::string> ParseJoinRequest(std::string_view body);

}  // namespace pangea
