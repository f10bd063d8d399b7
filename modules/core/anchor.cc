#include "core/anchor.h"

#include <fmt/format.h>

namespace pangea {

std::string ToString(const AnchorId& id) {
  return fmt::format("{}/{}", id.agent_id, id.created_utime);
}

}  // namespace pangea
