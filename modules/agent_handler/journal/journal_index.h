#pragma once

// Where in the journal each keyframe, its place match and the verification results on its
// candidates lie, and which of them are missing. No file: places in, places out.
//
// Memory: some 150 bytes per keyframe; matches and constraints are taken only of keyframes that are
// journalled, at most kMaxResults of one keyframe.

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
  int64_t offset = 0;  // of the event, bytes from the file's begin
  int32_t size = 0;    // of all of it
  uint32_t crc32 = 0;

  bool operator==(const JournalPlace&) const = default;
};

enum class JournalChannel { kKeyframe, kPlaceMatch, kConstraint };

class JournalIndex {
 public:
  static constexpr size_t kMaxResults = 200;

  enum class Added { kNew, kRepeat, kUnknownKeyframe };
  Added AddKeyframe(const KeyframeId& id, const JournalPlace& place);
  // Check first (kNew: it is worth journalling), then add it with its place.
  Added Check(const PlaceMatch& match) const;
  Added Check(const Constraint& constraint) const;
  void Add(const PlaceMatch& match, const JournalPlace& place);
  void Add(const Constraint& constraint, const JournalPlace& place);

  // A keyframe has one keyframe and one match, but any number of verification results.
  std::vector<JournalPlace> Find(JournalChannel channel, const KeyframeId& id) const;
  // The highest keyframe of a map; -1 for none.
  int32_t Highest(const MapId& map) const;
  std::vector<MapId> Maps() const;
  // Keyframes below a map's highest that are not there.
  std::vector<SeqGap> Gaps(const MapId& map) const;

  // Of these verification results, those that are there.
  std::vector<JournalPlace> Find(const ResultNames& names) const;

  // Keyframes up to `up_to` whose match is not there: the first gap of the map.
  std::optional<SeqGap> MissingMatches(const MapId& map, int32_t up_to) const;
  // Verification results on candidates of keyframes up to `up_to` that are not there: the first of
  // the map.
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
    // Below it every keyframe has its match.
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
