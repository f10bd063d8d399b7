#include "posegraph/grouping/map_pairs.h"

#include <algorithm>

#include "posegraph/grouping/different_tags.h"

namespace pangea {
namespace {

// A merge needs this many loops that the robust solve keeps.
constexpr int kMinLoopsInForce = 2;

bool AreLookAlikes(const MapPair& pair, const GraphMaps& maps) {
  // Two tags of which each map saw only one may be in line by chance, but not again and again.
  constexpr size_t kMinContradicted = 2;
  constexpr size_t kShare = 5;  // one in as many agreeing constraints
  const bool contradicted =
      pair.contradicted.size() >= kMinContradicted && !pair.evidence.HasSufficient() &&
      kShare * pair.contradicted.size() >= pair.evidence.decision().agreeing.size();
  return contradicted || HasDifferentTags(pair.evidence, maps[pair.a], maps[pair.b]);
}

}  // namespace

MapPair* MapPairs::FindOrAdd(const Key& key, const GraphMaps& maps) {
  const auto& [a, b] = key;
  const PairEvidence none(maps[a].chain, maps[b].chain, options_);
  return &pairs_.try_emplace(key, MapPair{a, b, none, false, {}, false}).first->second;
}

MapPair* MapPairs::PairOf(int map_a, int map_b, const GraphMaps& maps) {
  return FindOrAdd(maps[map_a].id < maps[map_b].id ? Key(map_a, map_b) : Key(map_b, map_a), maps);
}

bool MapPairs::Add(const Loop& loop, const GraphMaps& maps) {
  const NodeRef& from = loop.from;
  const NodeRef& to = loop.to;
  const bool forward = maps[from.map].id < maps[to.map].id;
  MapPair* const pair = PairOf(from.map, to.map, maps);
  const bool was_merged = pair->merged();
  pair->evidence.Add({.id = loop.id,
                      .node_a = forward ? from.node : to.node,
                      .node_b = forward ? to.node : from.node,
                      .relative = forward ? loop.relative : loop.relative.Inverse(),
                      .num_inliers = loop.num_inliers,
                      .sufficient = loop.sufficient});
  pair->undone = false;
  pair->different_tags = AreLookAlikes(*pair, maps);
  return pair->merged() != was_merged;
}

bool MapPairs::NoteDifferentTags(int map_a, int map_b, int64_t constraint_id,
                                 const GraphMaps& maps) {
  constexpr size_t kMaxNoted = 1000;
  MapPair* const pair = PairOf(map_a, map_b, maps);
  const bool was_merged = pair->merged();
  if (pair->contradicted.size() < kMaxNoted) {
    pair->contradicted.insert(constraint_id);
  }
  pair->different_tags = AreLookAlikes(*pair, maps);
  return pair->merged() != was_merged;
}

std::vector<const MapPair*> MapPairs::Among(const std::vector<int>& maps) const {
  std::vector<const MapPair*> pairs;
  for (const int map : maps) {
    for (auto it = pairs_.lower_bound({map, 0}); it != pairs_.end() && it->second.a == map; ++it) {
      if (std::ranges::binary_search(maps, it->second.b)) {
        pairs.push_back(&it->second);
      }
    }
  }
  return pairs;
}

std::vector<const MapPair*> MapPairs::All() const {
  std::vector<const MapPair*> pairs;
  for (const auto& [key, pair] : pairs_) {
    pairs.push_back(&pair);
  }
  return pairs;
}

bool MapPairs::UndoMerges(const std::vector<int>& maps, const std::vector<const Loop*>& loops) {
  std::map<Key, int> in_force;
  for (const Loop* loop : loops) {
    const auto [older, newer] = std::minmax(loop->from.map, loop->to.map);
    const int weight = loop->sufficient ? kMinLoopsInForce : 1;
    in_force[{older, newer}] += loop->on ? weight : 0;
  }
  bool any = false;
  for (const MapPair* pair : Among(maps)) {
    const auto [older, newer] = std::minmax(pair->a, pair->b);
    if (pair->merged() && in_force[{older, newer}] < kMinLoopsInForce) {
      pairs_.at({pair->a, pair->b}).undone = true;
      any = true;
    }
  }
  return any;
}

void MapPairs::RedoMerges() {
  for (auto& [key, pair] : pairs_) {
    pair.undone = false;
  }
}

void MapPairs::Save(ByteWriter* writer) const {
  writer->PutCount(pairs_.size());
  for (const auto& [key, pair] : pairs_) {
    writer->Put(pair.a);
    writer->Put(pair.b);
    writer->Put(pair.undone);
    writer->Put(std::vector<int64_t>(pair.contradicted.begin(), pair.contradicted.end()));
    writer->Put(pair.different_tags);
    pair.evidence.Save(writer);
  }
}

bool MapPairs::Restore(ByteReader* reader, const GraphMaps& maps) {
  const auto count = static_cast<int>(maps.size());
  for (size_t left = reader->GetCount(1); left > 0; --left) {
    Key key;
    bool undone = false, different_tags = false;
    reader->Get(&key.first);
    reader->Get(&key.second);
    reader->Get(&undone);
    std::vector<int64_t> contradicted;
    reader->Get(&contradicted);
    reader->Get(&different_tags);
    if (key.first < 0 || key.first >= count || key.second < 0 || key.second >= count ||
        pairs_.contains(key)) {
      return false;
    }
    MapPair* const pair = FindOrAdd(key, maps);
    pair->undone = undone;
    pair->contradicted = {contradicted.begin(), contradicted.end()};
    pair->different_tags = different_tags;
    if (!pair->evidence.Restore(reader)) {
      return false;
    }
  }
  return true;
}

}  // namespace pangea
