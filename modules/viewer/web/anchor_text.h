#pragma once

// What a page says of anchors (page_link.h), as a change.

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

#include "viewer/anchor_change.h"

namespace pangea::viewer {

// Metres from a keyframe that a place may be at most.
inline constexpr double kMaxAnchorDistance_m = 10'000;

// Nothing unless every field is there, is of its type and within its bounds, and no other is.
std::optional<AnchorChange> ParseAnchorChange(const std::string& key, const nlohmann::json& value);

}  // namespace pangea::viewer
