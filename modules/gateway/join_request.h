#pragma once

// The body of POST /v1/join, and the format of a code. After ParseJoinRequest both fields are
// within bounds.

#include <string>
#include <string_view>
#include <variant>

namespace pangea {

// A code has 80 random bits: 16 of the 32 characters of Crockford's base 32, "ABCD-EFGH-JKMN-PQRS".
inline constexpr size_t kCodeLetters = 16;
std::string NewJoinCode();
// The code without dashes and in upper case, with letters that look like digits replaced by these;
// so it does not matter how a person typed it. Empty if the text is not a code.
std::string PlainJoinCode(std::string_view text);

struct JoinRequest {
  std::string code;  // as PlainJoinCode returns it
  // UTF-8 without control characters, at most kMaxVisitorName bytes; may be empty.
  std::string name;
};

inline constexpr size_t kMaxVisitorName = 120;  // 40 characters, also Chinese ones
// Whether the text may be the name of a person or phone: see JoinRequest::name.
bool IsVisitorName(std::string_view text);

// Parses {"code": TEXT, "name": TEXT}; the name may be missing. The string says what is wrong, for
// the visitor.
std::variant<JoinRequest, std::string> ParseJoinRequest(std::string_view body);

}  // namespace pangea
