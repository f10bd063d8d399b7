#pragma once

// The id that the verification result of a candidate will have, before the result exists.

#include <cstdint>

#include "core/server_messages.h"

namespace pangea {

inline int64_t ConstraintId(const KeyframeId& query, const PlaceCandidate& candidate) {
  Constraint constraint;
  constraint.from = candidate.match;
  constraint.to = query;
  constraint.kind = candidate.kind;
  return constraint.Id();
}

}  // namespace pangea
