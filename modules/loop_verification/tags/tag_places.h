#pragma once

// Where the tags of a window are: from the rays to their centres and, if their size is given, from
// how large they look. So the place of a tag is known before there is parallax.

#include <map>
#include <optional>

#include "core/keyframe_store.h"
#include "core/tags/tag_sizes.h"

namespace pangea {

struct PlacedTag {
  Eigen::Vector3d p_w = Eigen::Vector3d::Zero();             // in the window frame (window.h)
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Identity();  // in window axes
};

// All tags that the keyframes see; those without size and parallax have no place.
std::map<TagId, std::optional<PlacedTag>> PlaceTags(const KeyframeWindow& frames,
                                                    const TagSizes& sizes);

}  // namespace pangea
