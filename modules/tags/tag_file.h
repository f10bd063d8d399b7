#pragma once

// A site's tags.yaml: the sizes of its tags.
//
//   tags:
//     - {ids: 0-19, size_m: 0.16}
//     - {family: 36h11, ids: "20, 22-25", size_m: 0.4}

#include <filesystem>
#include <vector>

#include "core/tags/tag_sizes.h"

namespace pangea {

// Throws std::runtime_error with file, field and correction.
std::vector<SizedTags> ReadTagFile(const std::filesystem::path& file);

}  // namespace pangea
