#pragma once

// Helpers to parse the API's requests and to make its answers.

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "anchors/api/anchor_json.h"
#include "anchors/api/edit_body.h"
#include "web/web_site.h"

namespace pangea::anchor_answers {

web::WebAnswer Json(int status, const nlohmann::json& body);
// The body is {"error": ...}, a text for people.
web::WebAnswer Error(int status, const std::string& error);
// Status 400, with the field.
web::WebAnswer Error(const BadField& bad);
// Status 405; `methods`: the allowed ones, "GET, PUT".
web::WebAnswer OnlyMethods(const char* methods);
// The anchor, with its revision as ETag.
web::WebAnswer OneAnchor(int status, const ListedAnchor& anchor);

std::string PercentDecoded(std::string_view text);
// "/v1/anchors/2/17" is {"v1", "anchors", "2", "17"}.
std::vector<std::string> SplitPath(const std::string& path);
// Takes the revision of If-Match, "3" with quotes or 3, unless it is empty or *. `known`: that of
// the body, which must not differ. The error is empty if all is well.
BadField TakeIfMatch(std::string_view if_match, std::optional<int64_t>* known);

}  // namespace pangea::anchor_answers
