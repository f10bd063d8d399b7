#include "place_recognition/place_recognition.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "place_recognition/guided_matching.h"
#include "place_recognition/two_views.h"

namespace pangea {
namespace {

// Maximum number of places that Places returns.
constexpr size_t kMaxPlaces = 100;
// A place is a run of 2 * kPlaceHalfWidth + 1 keyframes of one map.
constexpr int kPlaceHalfWidth = 5;

}  // namespace

PlaceRecognition::PlaceRecognition(const PlaceRecognitionOptions& options,
                                   std::shared_ptr<RecordStore> records)
    : options_(options), stored_(std::move(records)) {}

PlaceMatch PlaceRecognition::Add(const Keyframe& keyframe, std::vector<PlaceReport>* report) {
  const RecognisedKeyframe query(keyframe);
  PlaceMatch match;
  match.query = query.id;

  const std::vector<float> scores = index_.Query(query.corners, query.descriptor_kind);
  std::vector<Place> own;
  std::vector<Place> others;
  for (int i = 0; i < static_cast<int>(scores.size()); ++i) {
    if (scores[i] <= 0 || stored_.descriptor_kind(i) != query.descriptor_kind) {
      continue;
    }
    if (stored_.id(i).map != query.id.map) {
      others.push_back({i, scores[i]});
    } else if (!IsRecent(query, i)) {
      own.push_back({i, scores[i]});
    }
  }
  Search(query, own, kOwnMap, &match, report);
  Search(query, others, kOtherMaps, &match, report);
  AddTagCandidates(keyframe, &match);
  RememberPlaces(match);
  Store(query, keyframe.tags);
  return match;
}

void PlaceRecognition::Search(const RecognisedKeyframe& query, const std::vector<Place>& hits,
                              const Limits& limits, PlaceMatch* match,
                              std::vector<PlaceReport>* report) {
  std::vector<Place> places = Spread(Places(hits), limits.places);
  for (const Place& place : Continued(query.id, hits, limits.continued_places)) {
    if (std::none_of(places.begin(), places.end(),
                     [&](const Place& chosen) { return chosen.keyframe == place.keyframe; })) {
      places.push_back(place);
    }
  }
  counters_.places += static_cast<int64_t>(places.size());
  std::vector<PlaceCandidate> verified;
  for (const Place& place : places) {
    PlaceReport seen;
    if (auto candidate = Verify(query, place, match, &seen)) {
      verified.push_back(std::move(*candidate));
    }
    if (report != nullptr) {
      report->push_back(seen);
    }
  }
  Publish(std::move(verified), limits.candidates, match);
}

void PlaceRecognition::Publish(std::vector<PlaceCandidate> verified, int limit, PlaceMatch* match) {
  // Order: first the best of each map, then the second best of each, and so on.
  std::stable_sort(verified.begin(), verified.end(),
                   [](const PlaceCandidate& a, const PlaceCandidate& b) {
                     return a.corner_matches.size() > b.corner_matches.size();
                   });
  std::map<MapId, int> rank_in_map;
  std::vector<std::pair<int, size_t>> order;
  for (size_t i = 0; i < verified.size(); ++i) {
    order.emplace_back(rank_in_map[verified[i].match.map]++, i);
  }
  std::sort(order.begin(), order.end());
  for (size_t i = 0; i < order.size(); ++i) {
    PlaceCandidate& candidate = verified[order[i].second];
    if (static_cast<int>(i) < limit) {
      ++(candidate.match.map == match->query.map ? counters_.candidates_own
                                                 : counters_.candidates_other);
      match->candidates.push_back(std::move(candidate));
    } else {
      ++counters_.rejected_surplus;
      match->rejected.push_back(fmt::format("{}: {} corner matches, others have more",
                                            ToString(candidate.match),
                                            candidate.corner_matches.size()));
    }
  }
}

void PlaceRecognition::Remember(const Keyframe& keyframe, const PlaceMatch& known) {
  RememberPlaces(known);
  Store(RecognisedKeyframe(keyframe), keyframe.tags);
}

void PlaceRecognition::Save(ByteWriter* writer) {
  writer->Put(counters_.keyframes);
  writer->PutCount(last_matches_.size());
  for (const auto& [map, matches] : last_matches_) {
    writer->Put(map);
    writer->Put(matches);
  }
  stored_.Save(writer);
  tags_.Save(writer);
  index_.Save(writer);
}

bool PlaceRecognition::Restore(ByteReader* reader) {
  constexpr size_t kMinBytes = 16;
  Counters counters;
  reader->Get(&counters.keyframes);
  std::map<MapId, std::vector<KeyframeId>> last_matches;
  for (size_t left = reader->GetCount(kMinBytes); left > 0; --left) {
    MapId map;
    reader->Get(&map);
    reader->Get(&last_matches[map]);
  }
  StoredKeyframes stored(stored_.records());
  DescriptorIndex index;
  TagSightings tags(kMinSeqGap);
  const bool has_stored = stored.Restore(reader);
  tags.Restore(reader);
  if (!has_stored || !index.Restore(reader) || stored.size() != index.size() || !reader->at_end()) {
    return false;
  }
  counters_ = counters;
  last_matches_ = std::move(last_matches);
  stored_ = std::move(stored);
  tags_ = std::move(tags);
  index_ = std::move(index);
  return true;
}

// A pair of keyframes is a candidate once: by the tag, if both see one.
void PlaceRecognition::AddTagCandidates(const Keyframe& keyframe, PlaceMatch* match) {
  for (const KeyframeId& place : tags_.Places(keyframe.id, keyframe.tags)) {
    auto known = std::ranges::find(match->candidates, place, &PlaceCandidate::match);
    if (known == match->candidates.end()) {
      known = match->candidates.insert(known, {place, PlaceKind::kTag, 0, {}});
    }
    known->kind = PlaceKind::kTag;
    ++counters_.candidates_tag;
  }
}

void PlaceRecognition::Store(const RecognisedKeyframe& keyframe,
                             const std::vector<TagObservation>& tags) {
  ++counters_.keyframes;
  tags_.Add(keyframe.id, tags);
  if (index_.size() < options_.max_keyframes && stored_.Add(keyframe)) {
    index_.Add(keyframe.corners);
  }
}

bool PlaceRecognition::IsRecent(const RecognisedKeyframe& query, int other) const {
  return std::abs(query.id.seq - stored_.id(other).seq) < kMinSeqGap ||
         stored_.SharesLandmark(other, query);
}

std::vector<PlaceRecognition::Place> PlaceRecognition::Places(
    const std::vector<Place>& hits) const {
  // With equal scores the older keyframe first. A heap, since only the best few are needed.
  const auto worse = [](const Place& a, const Place& b) {
    return std::pair(a.score, -a.keyframe) < std::pair(b.score, -b.keyframe);
  };
  std::vector<Place> heap = hits;
  std::ranges::make_heap(heap, worse);
  std::vector<Place> places;
  std::map<MapId, std::vector<int32_t>> taken;
  while (!heap.empty() && places.size() < kMaxPlaces) {
    std::ranges::pop_heap(heap, worse);
    const Place hit = heap.back();
    heap.pop_back();
    const KeyframeId& id = stored_.id(hit.keyframe);
    std::vector<int32_t>& seqs = taken[id.map];
    if (std::none_of(seqs.begin(), seqs.end(),
                     [&](int32_t seq) { return std::abs(seq - id.seq) <= 2 * kPlaceHalfWidth; })) {
      seqs.push_back(id.seq);
      places.push_back(hit);
    }
  }
  return places;
}

std::vector<PlaceRecognition::Place> PlaceRecognition::Spread(const std::vector<Place>& places,
                                                              int limit) const {
  // Half of them by score alone, then the best place of each map not represented yet, then by
  // score.
  std::vector<Place> chosen;
  std::vector<bool> used(places.size(), false);
  std::vector<MapId> maps;
  const auto choose = [&](size_t i) {
    used[i] = true;
    chosen.push_back(places[i]);
    maps.push_back(stored_.id(places[i].keyframe).map);
  };
  const auto full = [&](int size) { return static_cast<int>(chosen.size()) >= size; };
  for (size_t i = 0; i < places.size() && !full(limit / 2); ++i) {
    choose(i);
  }
  for (size_t i = 0; i < places.size() && !full(limit); ++i) {
    const MapId& map = stored_.id(places[i].keyframe).map;
    if (!used[i] && std::find(maps.begin(), maps.end(), map) == maps.end()) {
      choose(i);
    }
  }
  for (size_t i = 0; i < places.size() && !full(limit); ++i) {
    if (!used[i]) {
      choose(i);
    }
  }
  return chosen;
}

std::vector<PlaceRecognition::Place> PlaceRecognition::Continued(const KeyframeId& query,
                                                                 const std::vector<Place>& hits,
                                                                 int limit) const {
  std::vector<Place> continued;
  const auto last = last_matches_.find(query.map);
  if (last == last_matches_.end()) {
    return {};
  }
  for (const KeyframeId& match : last->second) {
    Place best{-1, 0};
    for (const Place& hit : hits) {
      const KeyframeId& id = stored_.id(hit.keyframe);
      if (id.map == match.map && std::abs(id.seq - match.seq) <= kPlaceHalfWidth &&
          hit.score > best.score) {
        best = hit;
      }
    }
    if (best.keyframe >= 0) {
      continued.push_back(best);
    }
  }
  std::stable_sort(continued.begin(), continued.end(),
                   [](const Place& a, const Place& b) { return a.score > b.score; });
  if (static_cast<int>(continued.size()) > limit) {
    continued.resize(limit);
  }
  return continued;
}

std::optional<PlaceCandidate> PlaceRecognition::Verify(const RecognisedKeyframe& query,
                                                       const Place& place, PlaceMatch* match,
                                                       PlaceReport* report) {
  report->match = stored_.id(place.keyframe);
  report->score = place.score;
  const auto stored = stored_.Find(place.keyframe);
  if (stored == nullptr) {
    match->rejected.push_back(ToString(report->match) + ": cannot be read");
    return std::nullopt;
  }
  const RecognisedKeyframe& other = *stored;
  const MatchingOptions guided = GuidedMatching(query.descriptor_kind);
  TwoViewResult views = CheckTwoViews(query, other, RivalDistance(guided));
  if (!views.epipolar) {
    ++counters_.rejected_matching;
    match->rejected.push_back(
        fmt::format("{}: {} corner matches", ToString(other.id), views.num_matches));
    return std::nullopt;
  }
  const EpipolarResult& epipolar = *views.epipolar;
  report->inliers = static_cast<int>(epipolar.inliers.size());
  report->verified = epipolar.accepted;
  if (!epipolar.accepted) {
    ++counters_.rejected_epipolar;
    match->rejected.push_back(fmt::format("{}: {} of {} matches agree on a pose",
                                          ToString(other.id), epipolar.inliers.size(),
                                          views.num_matches));
    return std::nullopt;
  }
  PlaceCandidate candidate;
  candidate.match = other.id;
  candidate.kind = Kind(query.id.map, other.id.map);
  candidate.score = place.score;
  candidate.corner_matches =
      MatchAlongEpipolarLines(std::move(views.pairs), {query.corners, query.rays},
                              {other.corners, other.rays}, epipolar.model, guided);
  return candidate;
}

PlaceKind PlaceRecognition::Kind(const MapId& a, const MapId& b) const {
  return a == b && !groups_.IsFused(a) ? PlaceKind::kIntra : PlaceKind::kInter;
}

void PlaceRecognition::RememberPlaces(const PlaceMatch& match) {
  std::vector<KeyframeId>& last = last_matches_[match.query.map];
  last.clear();
  for (const PlaceCandidate& candidate : match.candidates) {
    last.push_back(candidate.match);
  }
}

}  // namespace pangea
