#include "place_recognition/tag_sightings.h"

#include <algorithm>
#include <functional>
#include <tuple>

namespace pangea {

void TagSightings::Add(const KeyframeId& id, const std::vector<TagObservation>& tags) {
  for (const TagObservation& seen : tags) {
    Seqs& of_tag = seqs_[seen.tag];
    if (!of_tag.contains(id.map) && num_lists_ == kMaxLists) {
      continue;
    }
    const auto [list, is_new] = of_tag.try_emplace(id.map);
    num_lists_ += is_new ? 1 : 0;
    std::vector<int32_t>& seqs = list->second;
    const size_t size = seqs.size();
    if (size >= 2 && seqs[size - 1] - seqs[size - 2] < min_seq_gap_) {
      seqs.back() = id.seq;
      continue;
    }
    if (size == kMaxKept) {
      seqs.erase(seqs.begin());
    }
    seqs.push_back(id.seq);
  }
}

std::vector<KeyframeId> TagSightings::Places(const KeyframeId& query,
                                             const std::vector<TagObservation>& tags) const {
  std::map<MapId, int32_t> newest;
  for (const TagObservation& seen : tags) {
    const auto of_tag = seqs_.find(seen.tag);
    if (of_tag == seqs_.end()) {
      continue;
    }
    for (const auto& [map, seqs] : of_tag->second) {
      const int32_t last = map == query.map ? query.seq - min_seq_gap_ : seqs.back();
      const auto after = std::ranges::upper_bound(seqs, last);
      if (after != seqs.begin()) {
        const auto known = newest.try_emplace(map, *std::prev(after)).first;
        known->second = std::max(known->second, *std::prev(after));
      }
    }
  }
  std::vector<KeyframeId> places;
  for (const auto& [map, seq] : newest) {
    places.push_back({map, seq});
  }
  std::ranges::sort(places, std::greater(), [](const KeyframeId& id) {
    return std::tuple(id.map.opened_utime, id.map.agent_id);
  });
  places.resize(std::min(places.size(), kMaxPlaces));
  return places;
}

void TagSightings::Save(ByteWriter* writer) const {
  writer->PutCount(num_lists_);
  for (const auto& [tag, of_tag] : seqs_) {
    for (const auto& [map, seqs] : of_tag) {
      writer->Put(tag.family);
      writer->Put(tag.id);
      writer->Put(map);
      writer->Put(seqs);
    }
  }
}

void TagSightings::Restore(ByteReader* reader) {
  constexpr size_t kMinBytes = sizeof(TagFamily) + 2 * sizeof(int32_t) + sizeof(int64_t);
  seqs_.clear();
  num_lists_ = reader->GetCount(kMinBytes);
  for (size_t i = 0; i < num_lists_; ++i) {
    TagId tag;
    MapId map;
    reader->Get(&tag.family);
    reader->Get(&tag.id);
    reader->Get(&map);
    reader->Get(&seqs_[tag][map]);
  }
}

}  // namespace pangea
