#pragma once

// Accepted constraints as they arrive. Each is used once; a constraint on an unknown keyframe waits
// until that keyframe arrives. At most kMaxWaiting wait: a further one is dropped, and is accepted
// if it is sent again.

#include <cstdint>
#include <functional>
#include <set>
#include <vector>

#include "core/byte_record.h"
#include "core/server_messages.h"

namespace pangea {

class ReceivedConstraints {
 public:
  static constexpr size_t kMaxWaiting = 5000;
  // Uses a constraint; returns false if one of its keyframes is unknown.
  using Use = std::function<bool(const Constraint&)>;

  // Ignores a repeat and a refused constraint.
  void Add(const Constraint& constraint, const Use& use);
  // Uses the constraints that wait for this keyframe, unless their other keyframe is unknown.
  void KeyframeCame(const KeyframeId& id, const Use& use);

  size_t num_waiting() const { return waiting_.size(); }

  void Save(ByteWriter* writer) const;
  // False if the bytes are not those of a ReceivedConstraints.
  bool Restore(ByteReader* reader);

 private:
  std::set<int64_t> received_;  // ids of constraints that were used or that wait
  std::vector<Constraint> waiting_;
};

}  // namespace pangea
