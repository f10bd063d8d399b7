#pragma once

// Anchors as the API says them (openapi_anchors.json has the schemas).

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "anchors/anchors.h"

namespace pangea {

// An anchor that is not deleted, and where its group has it, unless it is still to be placed.
struct ListedAnchor {
  AnchorState state;
  bool placed = false;
};
std::vector<ListedAnchor> ListAnchors(const Anchors& anchors);
std::optional<ListedAnchor> FindAnchor(const Anchors& anchors, const AnchorId& id);

// `pose` is in the odom frame of the state's map.
nlohmann::json ToJson(const ListedAnchor& anchor);
// Texts of apps need not be UTF-8: what is not is replaced.
std::string ToText(const nlohmann::json& value);

}  // namespace pangea
