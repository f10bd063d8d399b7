#pragma once

// Which items of a scene changed, in order: what a page that has seen everything up to a version
// lacks is what comes after it. An item that changes again moves to the end, so a slow page is told
// the newest state once and nothing piles up for it.

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
  int64_t index = 0;  // in the scene's list of that kind; an agent's is its id
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

  // Of the newest change; 0 while there is none.
  uint64_t version() const { return version_; }
  const std::map<uint64_t, Item>& by_version() const { return by_version_; }

 private:
  uint64_t version_ = 0;
  std::map<Item, uint64_t> version_of_;
  std::map<uint64_t, Item> by_version_;
};

}  // namespace pangea::viewer
