#pragma once

// The items of a scene in the order in which they last changed. A page that has seen everything up
// to a version lacks exactly the items after it. An item that changes again moves to the end; so a
// slow page gets only the newest state, and nothing accumulates for it.

#include <compare>
#include <cstdint>
#include <map>

namespace pangea::viewer {

enum class ItemKind : uint8_t {
  kMap,
  kAgent,
  kKeyframe,
  kSolved,
  kConstraint,
  kProcess,
  kFusion,
  kAnchor,
  kNotice
};

struct Item {
  ItemKind kind = ItemKind::kMap;
  int64_t index = 0;  // in the scene's list of this kind; for an agent, its id
  auto operator<=>(const Item&) const = default;
};

class Changes {
 public:
  void Touch(const Item& item) {
    uint64_t& version = version_of_[item];
    by_version_.erase(version);
    version = ++version_;
    by_version_[version] = item;
  }

  // The version of the newest change; 0 while there is none.
  uint64_t version() const { return version_; }
  const std::map<uint64_t, Item>& by_version() const { return by_version_; }

 private:
  uint64_t version_ = 0;
  std::map<Item, uint64_t> version_of_;
  std::map<uint64_t, Item> by_version_;
};

}  // namespace pangea::viewer
