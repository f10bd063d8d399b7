#include "anchors/api/answers.h"

#include <fmt/format.h>

#include <algorithm>

namespace pangea::anchor_answers {

using nlohmann::json;
using web::WebAnswer;

namespace {

int HexDigit(char c) {
  if (c >= '0' && c <= '9') {
    return c - '0';
  }
  const char lower = static_cast<char>(c | 0x20);
  return lower >= 'a' && lower <= 'f' ? lower - 'a' + 10 : -1;
}

}  // namespace

WebAnswer Json(int status, const json& body) {
  return {status, "application/json", ToText(body) + "\n"};
}

WebAnswer Error(int status, const std::string& error) { return Json(status, {{"error", error}}); }

WebAnswer Error(const BadField& bad) {
  return Json(400, {{"error", bad.field.empty() ? bad.error : bad.field + ": " + bad.error},
                    {"field", bad.field}});
}

WebAnswer OnlyMethods(const char* methods) {
  WebAnswer answer = Error(405, fmt::format("only {} here", methods));
  answer.headers = {{"Allow", methods}};
  return answer;
}

WebAnswer OneAnchor(int status, const ListedAnchor& anchor) {
  WebAnswer answer = Json(status, ToJson(anchor));
  answer.headers = {{"ETag", fmt::format("\"{}\"", anchor.state.revision)}};
  return answer;
}

std::string PercentDecoded(std::string_view text) {
  std::string decoded;
  for (size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '%' && i + 2 < text.size() && HexDigit(text[i + 1]) >= 0 &&
        HexDigit(text[i + 2]) >= 0) {
      decoded += static_cast<char>(16 * HexDigit(text[i + 1]) + HexDigit(text[i + 2]));
      i += 2;
    } else {
      decoded += text[i];
    }
  }
  return decoded;
}

std::vector<std::string> SplitPath(const std::string& path) {
  std::vector<std::string> parts;
  size_t begin = 1;
  while (path.starts_with('/') && begin <= path.size()) {
    const size_t end = std::min(path.find('/', begin), path.size());
    parts.push_back(path.substr(begin, end - begin));
    begin = end + 1;
  }
  return parts;
}

BadField TakeIfMatch(std::string_view if_match, std::optional<int64_t>* known) {
  if (if_match.empty() || if_match == "*") {
    return {};
  }
  if (if_match.size() > 2 && if_match.front() == '"' && if_match.back() == '"') {
    if_match = if_match.substr(1, if_match.size() - 2);
  }
  const auto matched = ParseNumber(if_match, 1LL << 60);
  if (!matched) {
    return {"If-Match", "give the revision, as \"3\""};
  }
  if (*known && *known != matched) {
    return {"revision", "is not that of If-Match: give one of them"};
  }
  *known = matched;
  return {};
}

}  // namespace pangea::anchor_answers
