#pragma once

// LCM messages become domain types here, and back. Parse checks that every field is finite and
// within bounds, or refuses the message with a reason. After it, no code checks again.

#include <optional>
#include <string>
#include <vector>

#include "core/keyframe.h"
#include "core/map_landmarks.h"
#include "core/others.h"
#include "core/server_messages.h"
#include "messages/keyframe_message.h"
#include "pangea/camera_t.hpp"
#include "pangea/constraint_t.hpp"
#include "pangea/correction_t.hpp"
#include "pangea/landmarks_t.hpp"
#include "pangea/map_state_t.hpp"
#include "pangea/options_t.hpp"
#include "pangea/others_t.hpp"
#include "pangea/place_match_t.hpp"
#include "pangea/rigid3_t.hpp"

namespace pangea {

template <typename T>
struct Parsed {
  std::optional<T> value;
  std::string refused;  // why there is no value
};

// The options of a running process. The text is not parsed here, because only the process' own
// module knows the keys.
struct ProcessOptions {
  std::string process;
  int64_t utime = 0;  // wall clock of the process' start
  std::string yaml;
};

map_id_t ToMessage(const MapId& id);
keyframe_id_t ToMessage(const KeyframeId& id);
rigid3_t ToMessage(const Rigid3& T);
vector3_t ToMessage(const Eigen::Vector3d& v);
camera_t ToMessage(const CameraModel& camera);
KeyframeMessage ToMessage(const Keyframe& keyframe);
place_match_t ToMessage(const PlaceMatch& match);
constraint_t ToMessage(const Constraint& constraint);
correction_t ToMessage(const Correction& correction);
landmarks_t ToMessage(const MapLandmarks& landmarks);
others_t ToMessage(const Others& others);
// Cuts the state into chunks of at most 500 keyframes, for state_chunks.h to join.
std::vector<map_state_t> ToMessages(const MapState& state);

Parsed<MapId> Parse(const map_id_t& message);
Parsed<KeyframeId> Parse(const keyframe_id_t& message);
Parsed<Rigid3> Parse(const rigid3_t& message);
Parsed<CameraModel> Parse(const camera_t& message);
Parsed<Keyframe> Parse(const KeyframeMessage& message);
Parsed<PlaceMatch> Parse(const place_match_t& message);
Parsed<Constraint> Parse(const constraint_t& message);
Parsed<Correction> Parse(const correction_t& message);
Parsed<MapLandmarks> Parse(const landmarks_t& message);
Parsed<Others> Parse(const others_t& message);
Parsed<ProcessOptions> Parse(const options_t& message);
// Returns one chunk as a MapState.
Parsed<MapState> Parse(const map_state_t& message);

}  // namespace pangea
