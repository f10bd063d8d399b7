#include "core/anchor.h"

#include <fmt/format.h>

#include "core/text/control_characters.h"

namespace pangea {

std::string ToString(const AnchorId& id) {
  return fmt::format("{}/{}", id.agent_id, id.created_utime);
}

std::string RefusalOfNewEdit(const AnchorEdit& edit) {
  if (edit.deleted) {
    return "";
  }
  if (edit.name.empty()) {
    return "anchor edit: no name";
  }
  return HasControlCharacter(edit.name) ? "anchor edit: control characters in the name" : "";
}

bool IsSameChange(const AnchorEdit& a, const AnchorEdit& b) {
  constexpr double kPrecision = 1e-6;
  const Rigid3 &T_a = a.T_ref_anchor, &T_b = b.T_ref_anchor;
  if (a.deleted || b.deleted) {
    return a.deleted && b.deleted;
  }
  return a.name == b.name && a.payload == b.payload && a.placement == b.placement &&
         (a.placement == AnchorEdit::Placement::kSame ||
          (a.map == b.map && a.keyframe_seq == b.keyframe_seq && a.utime == b.utime &&
           T_a.t.isApprox(T_b.t, kPrecision) && T_a.q.angularDistance(T_b.q) < kPrecision &&
           a.pixel.isApprox(b.pixel, 1e-4)));
}

std::string NameOf(const AnchorState& state) {
  return state.name.empty() || HasControlCharacter(state.name) ? ToString(state.anchor)
                                                               : state.name;
}

}  // namespace pangea
