#pragma once

// Parses a page's messages about anchors (page_link.h).

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

#include "viewer/anchor_change.h"

namespace pangea::viewer {

// Largest coordinate of a position relative to its keyframe.
inline constexpr double kMaxAnchorDistance_m = 10'000;

// Nothing unless exactly the required fields are there, with the right types and within bounds.
std::optional<AnchorChange> ParseAnchorChange(const std::string& key, const nlohmann::json& value);

}  // namespace pangea::viewer
