#pragma once

// A city of halls, made of one recorded hall: as many as are asked for, each visited several times.
//
// Every hall is the recorded one with a look of its own: its descriptors are the recorded ones,
// with the bits of one random mask flipped. Within a hall distances of descriptors stay as they
// were, and two halls have no more in common than chance. Each visit is the recorded walks under
// new map ids with fresh noise (visits/visit.h); the place matches and verification results of the
// recording come along, and hold between a visit and the one before it too, so that a hall is one
// group.
//
// Some halls look like the one before them: of a part of their landmarks, those in every second (or
// third ...) cell of space, the look is that hall's. What else ought to be seen there is not.

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/keyframe.h"
#include "core/server_messages.h"

namespace pangea::bench {

struct CityOptions {
  int alike_every = 8;  // of so many halls the second looks like the first; 0: none
  int alike_cells = 2;  // so far: one of so many cells of it
  // Halls are rooms of one building: a constraint, given as known, leads from each to the next.
  bool joined = false;
};

// A keyframe and what the server made of it.
struct Step {
  Keyframe keyframe;
  PlaceMatch match;
  std::vector<Constraint> results;
};

class City {
 public:
  // `log`: with keyframes, matches and verification results. Throws std::runtime_error.
  City(const std::string& log, const CityOptions& options);

  // In the order of the recording.
  std::vector<Step> Visit(int hall, int visit) const;
  // Of the recording's first map, as one agent that comes for the first time: without what the
  // server makes of it.
  std::vector<Keyframe> Walk(int hall, int visit) const;
  int keyframes_a_visit() const { return static_cast<int>(recorded_.size()); }

  // The hall that a part of this one looks like.
  std::optional<int> ModelOf(int hall) const;
  int HallOf(const MapId& map) const;
  // In its hall; of all visits the same, which the recording's own solution tells.
  const Rigid3& Truth(const KeyframeId& id) const;
  // An accepted one that joins two halls, or is off by more than 0.5 m or 5 degrees.
  bool IsWrong(const Constraint& constraint) const;

 private:
  struct Landmarks {
    std::map<int32_t, bool> in_model_cell;  // by landmark_id
  };

  void Read(const std::string& log);
  void Solve();
  // The same of an accepted one of the recording.
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
  std::vector<std::vector<Keyframe>> of_map_;  // by index of the map, ascending seq
  std::vector<Landmarks> landmarks_;           // the same
  std::map<KeyframeId, Rigid3> truth_;         // of the recording
};

}  // namespace pangea::bench
