#pragma once

// An index of the journal: the place of each keyframe, of its place match, and of the verification
// results on its candidates; and which of them are missing. It does not read the file.
//
// Memory: about 150 bytes per keyframe. Matches and constraints are indexed only for keyframes that
// are journalled, at most kMaxResults constraints for one keyframe.

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "bus/retransmission/reorder_buffer.h"
#include "core/server_messages.h"
#include "messages/catch_up_messages.h"

namespace pangea {

struct JournalPlace {
  int64_t offset = 0;  // of the event, in bytes from the beginning of the file
  int32_t size = 0;    // of the whole event, bytes
  uint32_t crc32 = 0;

  bool operator==(const JournalPlace&) const = default;
};

enum class JournalChannel { kKeyframe, kPlaceMatch, kConstraint };

class JournalIndex {
 public:
  static constexpr size_t kMaxResults = 200;

  enum class Added { kNew, kRepeat, kUnknownKeyframe };
  Added AddKeyframe(const KeyframeId& id, const JournalPlace& place);
  // Call Check first. If it returns kNew, journal the message, and call Add with its place.
  Added Check(const PlaceMatch& match) const;
  Added Check(const Constraint& constraint) const;
  void Add(const PlaceMatch& match, const JournalPlace& place);
  void Add(const Constraint& constraint, const JournalPlace& place);

  // The places of a keyframe's messages on a channel: at most one keyframe and one match, but any
  // number of verification results.
  std::vector<JournalPlace> Find(JournalChannel channel, const KeyframeId& id) const;
  // The highest seq of a map; -1: none.
  int32_t Highest(const MapId& map) const;
  std::vector<MapId> Maps() const;
  // The missing keyframes of a map below its highest seq.
  std::vector<SeqGap> Gaps(const MapId& map) const;

  // The places of those of the named verification results that are there.
  std::vector<JournalPlace> Find(const ResultNames& names) const;

  // The first gap of keyframes up to `up_to` whose match is missing.
  std::optional<SeqGap> MissingMatches(const MapId& map, int32_t up_to) const;
  // The missing verification results on candidates of keyframes up to `up_to`: the first
  // ResultNames::kMax of the map.
  ResultNames MissingResults(const MapId& map, int32_t up_to) const;
  int64_t num_keyframes() const { return num_keyframes_; }
  int64_t num_matches() const { return num_matches_; }
  int64_t num_constraints() const { return num_constraints_; }
  int64_t num_missing_results() const { return num_missing_results_; }

 private:
  struct MapIndex {
    std::map<int32_t, JournalPlace> keyframes;
    std::map<int32_t, JournalPlace> matches;
    std::map<int32_t, std::map<int64_t, JournalPlace>> results;  // by the constraint's id
    std::map<int32_t, std::set<int64_t>> missing_results;
    // Every keyframe below this has its match.
    int32_t matched_below = 0;
  };
  const MapIndex* FindMap(const MapId& id) const;

  std::map<MapId, MapIndex> maps_;
  int64_t num_keyframes_ = 0;
  int64_t num_matches_ = 0;
  int64_t num_constraints_ = 0;
  int64_t num_missing_results_ = 0;
};

}  // namespace pangea
