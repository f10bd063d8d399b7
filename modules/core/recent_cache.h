#pragma once

// A least-recently-used cache of at most `max_values` values. Not thread safe.

#include <cstddef>
#include <list>
#include <map>
#include <memory>
#include <utility>

namespace pangea {

template <typename Key, typename Value>
class RecentCache {
 public:
  using Pointer = std::shared_ptr<const Value>;

  explicit RecentCache(size_t max_values) : max_values_(max_values) {}

  // Null when the key is not there.
  Pointer Find(const Key& key) {
    const auto found = entries_.find(key);
    if (found == entries_.end()) {
      return nullptr;
    }
    uses_.splice(uses_.begin(), uses_, found->second);
    return found->second->second;
  }
  // The key must not be there yet.
  void Add(const Key& key, Pointer value) {
    uses_.emplace_front(key, std::move(value));
    entries_.emplace(key, uses_.begin());
    if (uses_.size() > max_values_) {
      Erase(uses_.back().first);
    }
  }
  void Erase(const Key& key) {
    if (const auto found = entries_.find(key); found != entries_.end()) {
      uses_.erase(found->second);
      entries_.erase(found);
    }
  }

 private:
  using Uses = std::list<std::pair<Key, Pointer>>;

  size_t max_values_;
  Uses uses_;  // most recently used first
  std::map<Key, typename Uses::iterator> entries_;
};

}  // namespace pangea
