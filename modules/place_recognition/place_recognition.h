#pragma once

// Which places does this keyframe show again? (the paper, section IV.C)
//
// In: keyframes of any number of maps, and which maps are fused. Out: for each keyframe one
// PlaceMatch with the older keyframes that show the same place, with their corner matches.
// Two searches by one inverted index: in the keyframe's own map, without what odometry still
// connects it to, and in all other maps. The best few places of each are verified: corners matched
// by descriptor, then one relative pose has to explain them (epipolar_check.h), which then guides a
// second matching. Whether a candidate is true is for the geometry of inter_map_ba and fusion to
// decide: this module would rather ask once too often.
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

namespace pangea {

struct PlaceRecognitionOptions {
  // Keyframes beyond this many are still recognised but no longer remembered (about 20 kB each).
  int max_keyframes = 100000;

  template <typename Archive>
  void Visit(Archive& archive) {
    archive.Add("max_keyframes", &max_keyframes, {1, 1000000}, "",
                "that are remembered, about 20 kB each");
  }
};

// A place that was looked at and how far it came, for whoever measures this module.
struct PlaceReport {
  KeyframeId match;
  float score = 0;        // of the retrieval, 0 .. 1
  int inliers = 0;        // matched corners that agree on one pose; 0: too few were matched
  bool verified = false;  // more agree than chance explains
};

class PlaceRecognition {
 public:
  // Own map: a keyframe is recent while it is this near in seq or still shares a tracked landmark.
  static constexpr int kMinSeqGap = 20;

  struct Counters {
    int64_t keyframes = 0;
    int64_t places = 0;          // looked at by descriptor matching
    int64_t candidates_own = 0;  // published
    int64_t candidates_other = 0;
    int64_t rejected_matching = 0;
    int64_t rejected_epipolar = 0;
    int64_t rejected_surplus = 0;
  };

  // `records`: for corners and rays (stored_keyframes.h).
  explicit PlaceRecognition(const PlaceRecognitionOptions& options,
                            std::shared_ptr<RecordStore> records = nullptr);

  // Recognises, then remembers. `report` gets every place that was looked at.
  PlaceMatch Add(const Keyframe& keyframe, std::vector<PlaceReport>* report = nullptr);
  // Remembers only: for keyframes whose match is known from an earlier run.
  void Remember(const Keyframe& keyframe, const PlaceMatch& known);

  // All it remembers, but for the groups, and the records of keyframes, of which it says where they
  // are. Restored: false, and nothing has changed, if these are not the bytes of one.
  void Save(ByteWriter* writer);
  bool Restore(ByteReader* reader);

  // Which maps are one group. The highest revision wins, map by map.
  void Take(const MapState& state) { groups_.Take({state.revision, state.maps}); }

  const Counters& counters() const { return counters_; }
  const RecordCounters& store_counters() const { return stored_.counters(); }

 private:
  struct Place {
    int keyframe = 0;  // index into stored_
    float score = 0;
  };
  struct Limits {
    int places;            // verified: the best by retrieval
    int continued_places;  // and those next to where the previous keyframe was recognised
    int candidates;        // published at most: each costs its consumer a bundle adjustment
  };
  struct GroupMaps {
    int64_t revision = 0;
    std::vector<MapId> maps;
  };
  static constexpr Limits kOwnMap{.places = 5, .continued_places = 2, .candidates = 3};
  static constexpr Limits kOtherMaps{.places = 8, .continued_places = 3, .candidates = 5};

  void Store(const RecognisedKeyframe& keyframe);
  bool IsRecent(const RecognisedKeyframe& query, int other) const;
  // Best first, one per run of neighbouring keyframes.
  std::vector<Place> Places(const std::vector<Place>& hits) const;
  // Of places in many maps, so that no map crowds out another.
  std::vector<Place> Spread(const std::vector<Place>& places, int limit) const;
  // Where the previous keyframe of this map was recognised, one step further.
  std::vector<Place> Continued(const KeyframeId& query, const std::vector<Place>& hits,
                               int limit) const;
  // One of the two searches: from keyframes that share descriptors to published candidates.
  void Search(const RecognisedKeyframe& query, const std::vector<Place>& hits, const Limits& limits,
              PlaceMatch* match, std::vector<PlaceReport>* report);
  std::optional<PlaceCandidate> Verify(const RecognisedKeyframe& query, const Place& place,
                                       PlaceMatch* match, PlaceReport* report);
  void Publish(std::vector<PlaceCandidate> verified, int limit, PlaceMatch* match);
  PlaceKind Kind(const MapId& a, const MapId& b) const;
  void RememberPlaces(const PlaceMatch& match);

  PlaceRecognitionOptions options_;
  DescriptorIndex index_;
  StoredKeyframes stored_;                                 // numbered as in index_
  std::map<MapId, std::vector<KeyframeId>> last_matches_;  // of each map's newest keyframe
  GroupStates<GroupMaps> groups_;
  Counters counters_;
};

}  // namespace pangea
