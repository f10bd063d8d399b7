#pragma once

// Accepted constraints as they are received: each is used once, and one that is about an unknown
// keyframe waits for it. At most kMaxWaiting wait: one that comes then is forgotten, and may come
// again.

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
  // Uses a constraint; false when a keyframe of it is unknown.
  using Use = std::function<bool(const Constraint&)>;

  // A repeat and a refusal are not used.
  void Add(const Constraint& constraint, const Use& use);
  // What waits for this keyframe is used, unless its other one is unknown.
  void KeyframeCame(const KeyframeId& id, const Use& use);

  size_t num_waiting() const { return waiting_.size(); }

  void Save(ByteWriter* writer) const;
  // False if these are not the bytes of one.
  bool Restore(ByteReader* reader);

 private:
  std::set<int64_t> received_;  // ids of what was used or waits
  std::vector<Constraint> waiting_;
};

}  // namespace pangea
