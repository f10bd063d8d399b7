#pragma once

// Finds earlier keyframes that show the same place as a new keyframe (the paper, section IV.C).
//
// In: keyframes of any number of maps, and which maps are fused. Out: for each keyframe one
// PlaceMatch with the candidates (older keyframes of the same place) and their corner matches. One
// inverted index serves two searches: in the keyframe's own map, except its recent keyframes, and
// in all other maps. The best places of each search are checked: corners are matched by descriptor,
// one relative pose must explain the matches (epipolar_check.h), and this pose guides a second
// matching. inter_map_ba and fusion verify the candidates, so this module prefers a false candidate
// to a missed one. A keyframe that sees an AprilTag is a candidate for those that saw it before,
// whatever the images look like.
//
// Deterministic: the same calls in the same order give the same matches. One thread.

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/group_states.h"
#include "core/keyframe.h"
#include "core/server_messages.h"
#include "place_recognition/descriptor_index.h"
#include "place_recognition/stored_keyframes.h"
#include "place_recognition/tag_sightings.h"

namespace pangea {

struct PlaceRecognitionOptions {
  // Keyframes beyond this number are still recognised, but not stored (about 20 kB each).
  int max_keyframes = 100000;

  template <typename Archive>
  void Visit(Archive& archive) {
    archive.Add("max_keyframes", &max_keyframes, {1, 1000000}, "",
                "that are remembered, about 20 kB each");
  }
};

// A place that was checked, and the result; for measurements of this module.
struct PlaceReport {
  KeyframeId match;
  float score = 0;        // of the retrieval, 0 .. 1
  int inliers = 0;        // matches that fit one pose; 0: too few matches
  bool verified = false;  // accepted by the epipolar check
};

class PlaceRecognition {
 public:
  // A keyframe of the own map is recent, and not searched, if it is nearer than this in seq or
  // shares a tracked landmark with the query.
  static constexpr int kMinSeqGap = 20;

  struct Counters {
    int64_t keyframes = 0;
    int64_t places = 0;          // checked by descriptor matching
    int64_t candidates_own = 0;  // published
    int64_t candidates_other = 0;
    int64_t candidates_tag = 0;
    int64_t rejected_matching = 0;
    int64_t rejected_epipolar = 0;
    int64_t rejected_surplus = 0;
  };

  // `records`: for corners and rays (stored_keyframes.h).
  explicit PlaceRecognition(const PlaceRecognitionOptions& options,
                            std::shared_ptr<RecordStore> records = nullptr);

  // Recognises, then stores the keyframe. `report` receives every place that was checked.
  PlaceMatch Add(const Keyframe& keyframe, std::vector<PlaceReport>* report = nullptr);
  // Only stores the keyframe: for one whose match is known from an earlier run.
  void Remember(const Keyframe& keyframe, const PlaceMatch& known);

  // Saves everything stored, except the groups; of the keyframes' records only their places in the
  // RecordStore. Restore returns false, and changes nothing, if the bytes are not those of a
  // PlaceRecognition.
  void Save(ByteWriter* writer);
  bool Restore(ByteReader* reader);

  // Updates which maps form one group. For each map the state with the highest revision counts.
  void Take(const MapState& state) { groups_.Take({state.revision, state.maps}); }

  const Counters& counters() const { return counters_; }
  const RecordCounters& store_counters() const { return stored_.counters(); }

 private:
  struct Place {
    int keyframe = 0;  // index into stored_
    float score = 0;
  };
  struct Limits {
    int places;            // checked: the best by retrieval score
    int continued_places;  // checked in addition: near the previous keyframe's matches
    int candidates;        // published at most; each costs a bundle adjustment
  };
  static constexpr Limits kOwnMap{.places = 5, .continued_places = 2, .candidates = 3};
  static constexpr Limits kOtherMaps{.places = 8, .continued_places = 3, .candidates = 5};

  void Store(const RecognisedKeyframe& keyframe, const std::vector<TagObservation>& tags);
  bool IsRecent(const RecognisedKeyframe& query, int other) const;
  // One hit per run of neighbouring keyframes, best first.
  std::vector<Place> Places(const std::vector<Place>& hits) const;
  // Selects `limit` places so that no map crowds out the others.
  std::vector<Place> Spread(const std::vector<Place>& places, int limit) const;
  // The best hits near the places where the previous keyframe of this map was recognised.
  std::vector<Place> Continued(const KeyframeId& query, const std::vector<Place>& hits,
                               int limit) const;
  // One of the two searches: selects and checks places among `hits`, and adds candidates to
  // `match`.
  void Search(const RecognisedKeyframe& query, const std::vector<Place>& hits, const Limits& limits,
              PlaceMatch* match, std::vector<PlaceReport>* report);
  std::optional<PlaceCandidate> Verify(const RecognisedKeyframe& query, const Place& place,
                                       PlaceMatch* match, PlaceReport* report);
  void Publish(std::vector<PlaceCandidate> verified, int limit, PlaceMatch* match);
  void AddTagCandidates(const Keyframe& keyframe, PlaceMatch* match);
  PlaceKind Kind(const MapId& a, const MapId& b) const;
  void RememberPlaces(const PlaceMatch& match);

  PlaceRecognitionOptions options_;
  DescriptorIndex index_;
  StoredKeyframes stored_;                                 // numbered as in index_
  std::map<MapId, std::vector<KeyframeId>> last_matches_;  // by map: matches of its newest keyframe
  TagSightings tags_{kMinSeqGap};
  GroupStates<GroupMaps> groups_;
  Counters counters_;
};

}  // namespace pangea
