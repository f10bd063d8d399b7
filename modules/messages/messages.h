#pragma once

// The border: LCM messages become domain types here, bounded and finite, or are refused with a
// reason. Past it nothing checks again.

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

// What a process runs with: the text is read as options, and checked, by who knows them.
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
// At most 500 keyframes a chunk.
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
// One chunk as a MapState of its own.
Parsed<MapState> Parse(const map_state_t& message);

}  // namespace pangea
