#include "core/tags/tag.h"

#include <fmt/format.h>

namespace pangea {

int NumTagIds(TagFamily /*family*/) { return 587; }

std::string_view NameOf(TagFamily /*family*/) { return "36h11"; }

std::optional<TagFamily> TagFamilyOf(int number) {
  return number == static_cast<int>(TagFamily::k36h11) ? std::optional(TagFamily::k36h11)
                                                       : std::nullopt;
}

std::string ToString(const TagId& tag) { return fmt::format("{}:{}", NameOf(tag.family), tag.id); }

}  // namespace pangea
