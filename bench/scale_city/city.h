#pragma once

// Simulates a city of many halls from one recorded hall, each visited several times.
//
// Every hall is the recorded one with its own appearance: its descriptors are the recorded ones,
// with the bits of one random mask flipped. Within a hall the distances between descriptors are
// unchanged, and two halls are similar only by chance. A visit is a copy of the recorded walks with
// new map ids and new noise (visits/visit.h). The recording's place matches and verification
// results are copied too, also between a visit and the previous one, so that a hall is one group.
//
// Some halls resemble the previous hall: part of their landmarks, those in every second (or third,
// ...) cell of space, have the appearance of that hall. The other landmarks differ.

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "bench/cores/step.h"

namespace pangea::bench {

struct CityOptions {
  // In every group of this many halls, the second resembles the first; 0: none
  int alike_every = 8;
  int alike_cells = 2;  // one in this many cells is alike
  // Halls are rooms of one building: a known constraint connects each to the next.
  bool joined = false;
};

class City {
 public:
  // `log`: contains keyframes, matches and verification results. Throws std::runtime_error.
  City(const std::string& log, const CityOptions& options);

  // A visit's keyframes with their results, in the order of the recording.
  std::vector<Step> Visit(int hall, int visit) const;
  // The keyframes of the recording's first map, as a new agent: without matches and results.
  std::vector<Keyframe> Walk(int hall, int visit) const;
  int keyframes_a_visit() const { return static_cast<int>(recorded_.size()); }

  // The hall that this one resembles; empty if none.
  std::optional<int> ModelOf(int hall) const;
  int HallOf(const MapId& map) const;
  // The true pose in its hall, the same for all visits: from the pose graph's solution of the
  // recording.
  const Rigid3& Truth(const KeyframeId& id) const;
  // Whether an accepted constraint joins two halls, or has an error above 0.5 m or 5 degrees.
  bool IsWrong(const Constraint& constraint) const;

 private:
  struct Landmarks {
    std::map<int32_t, bool> in_model_cell;  // by landmark_id
  };

  void Read(const std::string& log);
  void Solve();
  // The same for an accepted constraint of the recording.
  bool IsOff(const Constraint& recorded) const;
  void FindCells();
  int MapIndex(const MapId& map) const {
    return (map.agent_id - 1) % static_cast<int>(maps_.size());
  }
  KeyframeId At(int hall, int visit, const KeyframeId& recorded) const;
  std::vector<Keyframe> Walk(int map, int hall, int visit) const;
  void SetLook(int map, int hall, std::vector<Keyframe>* keyframes) const;
  PlaceMatch MatchAt(int hall, int visit, const Step& recorded) const;
  std::vector<Constraint> ResultsAt(int hall, int visit, const Step& recorded) const;
  Constraint DoorTo(int hall) const;

  CityOptions options_;
  std::vector<Step> recorded_;
  std::vector<MapId> maps_;                    // of the recording
  std::vector<std::vector<Keyframe>> of_map_;  // by map index; ascending seq
  std::vector<Landmarks> landmarks_;           // by map index
  std::map<KeyframeId, Rigid3> truth_;         // of the recording
};

}  // namespace pangea::bench
