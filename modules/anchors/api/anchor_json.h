#pragma once

// Anchors as JSON of the API (openapi_anchors.json has the schemas).

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "anchors/anchors.h"

namespace pangea {

// An anchor that is not deleted, with its pose in its group if it is placed.
struct ListedAnchor {
  AnchorState state;
  bool placed = false;
};
std::vector<ListedAnchor> ListAnchors(const Anchors& anchors);
std::optional<ListedAnchor> FindAnchor(const Anchors& anchors, const AnchorId& id);

// `pose` is in the odom frame of the state's map.
nlohmann::json ToJson(const ListedAnchor& anchor);
// Texts from apps may contain invalid UTF-8; it is replaced.
std::string ToText(const nlohmann::json& value);

}  // namespace pangea
