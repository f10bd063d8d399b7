#include "tags/tag_pattern.h"

#include <cstdlib>

extern "C" {
#include <apriltag/apriltag.h>
#include <apriltag/tag36h11.h>
}

namespace pangea {

TagPattern PatternOf(const TagId& tag) {
  apriltag_family_t* const family = tag36h11_create();
  image_u8_t* const image = apriltag_to_image(family, static_cast<uint32_t>(tag.id));
  TagPattern pattern;
  pattern.cells = image->width;
  pattern.square_cells = family->width_at_border;
  for (int row = 0; row < image->height; ++row) {
    for (int column = 0; column < image->width; ++column) {
      pattern.white.push_back(image->buf[row * image->stride + column] != 0);
    }
  }
  std::free(image->buf);  // the library exports no function for this
  std::free(image);
  tag36h11_destroy(family);
  return pattern;
}

}  // namespace pangea
