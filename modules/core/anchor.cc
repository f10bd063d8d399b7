#include "core/anchor.h"

#include <fmt/format.h>

namespace pangea {

std::string ToString(const AnchorId& id) {
  return fmt::format("{}/{}", id.agent_id, id.created_utime);
}

std::string RefusalOfNewEdit(const AnchorEdit& edit) {
  return edit.name.empty() && !edit.deleted ? "anchor edit: no name" : "";
}

std::string NameOf(const AnchorState& state) {
  return state.name.empty() ? ToString(state.anchor) : state.name;
}

}  // namespace pangea
