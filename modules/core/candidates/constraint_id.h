#pragma once

// The id of the verification result on a candidate, before there is one.

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
