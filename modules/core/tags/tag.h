#pragma once

// AprilTags: printed squares whose pattern names them (Olson, ICRA 2011).
//
// Frame of a tag: the origin is its centre, x to the right and y down as one looks at it, z into
// its wall. Its size is the side of the black square.

#include <Eigen/Core>
#include <array>
#include <compare>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace pangea {

enum class TagFamily : int8_t {
  k36h11 = 1,
};
// The number of ids of a family: 0 to this minus one.
int NumTagIds(TagFamily family);
// "36h11".
std::string_view NameOf(TagFamily family);
// The family of a number in a message; nothing if it is unknown.
std::optional<TagFamily> TagFamilyOf(int number);

struct TagId {
  TagFamily family = TagFamily::k36h11;
  int32_t id = 0;
  auto operator<=>(const TagId&) const = default;
};
// "36h11:17", for people.
std::string ToString(const TagId& tag);

inline constexpr int kTagCorners = 4;
// The corners of a tag of size 2 in its frame, in libapriltag's order.
inline constexpr std::array<std::array<double, 2>, kTagCorners> kTagCornerSigns = {
    {{-1, 1}, {1, 1}, {1, -1}, {-1, -1}}};

// A tag in a keyframe's image.
struct TagObservation {
  TagId tag;
  // Raw (distorted) pixels, in the order of kTagCornerSigns.
  std::array<Eigen::Vector2f, kTagCorners> corners{};
};
// Largest number of tags in a keyframe.
inline constexpr int kMaxTags = 16;

}  // namespace pangea
