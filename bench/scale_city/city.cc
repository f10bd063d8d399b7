#include "bench/scale_city/city.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <stdexcept>
#include <utility>

#include "bench/visits/visit.h"
#include "log_file/log_reader.h"
#include "messages/channels.h"
#include "messages/encoding.h"
#include "messages/messages.h"
#include "posegraph/posegraph.h"

namespace pangea::bench {
namespace {

constexpr int64_t kDay_us = int64_t{24} * 3600 * 1'000'000;
constexpr double kCell_m = 2;
constexpr double kWrong_m = 0.5;
constexpr double kWrong_rad = 5 * M_PI / 180;
// Distance from one hall to the next, and sigmas of the constraint through a door.
constexpr double kHall_m = 30, kDoorSigma_m = 0.1, kDoorSigma_rad = 0.02;

template <typename Message>
auto Parsed(const LogEvent& event) {
  Message message{};
  if (!DecodeMessage(event.data, &message)) {
    throw std::runtime_error(fmt::format("{} does not decode", event.channel));
  }
  auto parsed = Parse(message);
  if (!parsed.value) {
    throw std::runtime_error(fmt::format("{}: {}", event.channel, parsed.refused));
  }
  return *std::move(parsed.value);
}

void Flip(const Descriptor& mask, Descriptor* descriptor) {
  for (size_t i = 0; i < mask.size(); ++i) {
    (*descriptor)[i] ^= mask[i];
  }
}

Descriptor MaskOf(int hall) {
  std::mt19937_64 random(hall + 1);
  Descriptor mask;
  std::ranges::generate(mask, random);
  return mask;
}

// Whether a point is in one of `every` cells along each axis.
bool InModelCell(const Eigen::Vector3d& p_map, int every) {
  const auto cell = static_cast<int64_t>((p_map / kCell_m).array().floor().sum());
  return (cell % every + every) % every == 0;
}

}  // namespace

City::City(const std::string& log, const CityOptions& options) : options_(options) {
  Read(log);
  Solve();
  FindCells();
}

void City::Read(const std::string& log) {
  std::map<KeyframeId, PlaceMatch> matches;
  std::map<KeyframeId, std::vector<Constraint>> results;
  ReadLog(log, [&](const LogEvent& event) {
    if (event.channel.starts_with(channels::kKeyframePrefix)) {
      recorded_.push_back({Parsed<KeyframeMessage>(event), {}, {}});
    } else if (event.channel == channels::kPlaceMatch) {
      auto match = Parsed<place_match_t>(event);
      matches.emplace(match.query, std::move(match));
    } else if (event.channel == channels::kConstraint) {
      const auto result = Parsed<constraint_t>(event);
      results[result.to].push_back(result);
    }
  });
  for (Step& step : recorded_) {
    const KeyframeId& id = step.keyframe.id;
    const auto known = std::ranges::find(maps_, id.map);
    const size_t map = known - maps_.begin();
    if (known == maps_.end()) {
      maps_.push_back(id.map);
      of_map_.emplace_back();
    }
    if (id.seq != static_cast<int32_t>(of_map_[map].size())) {
      throw std::runtime_error(fmt::format("{}: {} is out of order", log, ToString(id)));
    }
    of_map_[map].push_back(step.keyframe);
    step.match = matches[id];
    step.match.query = id;
    step.results = results[id];
  }
  if (recorded_.empty()) {
    throw std::runtime_error(log + " has no keyframe");
  }
}

void City::Solve() {
  PoseGraph graph(PoseGraphOptions{});
  for (const Step& step : recorded_) {
    graph.AddKeyframe(step.keyframe);
    for (const Constraint& result : step.results) {
      graph.AddConstraint(result);
    }
  }
  graph.Finish();
  const std::vector<MapState> states = graph.States();
  if (states.size() != 1) {
    throw std::runtime_error(fmt::format("the recording's maps are {} groups", states.size()));
  }
  for (const KeyframePose& pose : states.front().keyframes) {
    truth_[pose.id] = pose.T_map_body;
  }
  for (Step& step : recorded_) {
    std::erase_if(step.results, [this](const Constraint& result) { return IsOff(result); });
  }
}

void City::FindCells() {
  for (const std::vector<Keyframe>& keyframes : of_map_) {
    Landmarks& landmarks = landmarks_.emplace_back();
    for (const Keyframe& keyframe : keyframes) {
      const Rigid3 T_map_cam = truth_.at(keyframe.id) * keyframe.camera.T_body_cam;
      for (const MapPoint& point : keyframe.points) {
        const int32_t landmark = keyframe.corners[point.corner].landmark_id;
        const auto p_cam = PointInCamera(keyframe, point);
        if (p_cam && landmark != kNoLandmark) {
          landmarks.in_model_cell.try_emplace(
              landmark, InModelCell(T_map_cam * *p_cam, options_.alike_cells));
        }
      }
    }
  }
}

std::optional<int> City::ModelOf(int hall) const {
  const bool alike = options_.alike_every > 0 && hall % options_.alike_every == 1;
  return alike ? std::make_optional(hall - 1) : std::nullopt;
}

int City::HallOf(const MapId& map) const {
  return (map.agent_id - 1) / static_cast<int>(maps_.size());
}

KeyframeId City::At(int hall, int visit, const KeyframeId& recorded) const {
  const auto index = std::ranges::find(maps_, recorded.map) - maps_.begin();
  return {{static_cast<int32_t>(hall * maps_.size() + index + 1),
           recorded.map.opened_utime + visit * kDay_us},
          recorded.seq};
}

const Rigid3& City::Truth(const KeyframeId& id) const {
  return truth_.at({maps_[MapIndex(id.map)], id.seq});
}

bool City::IsWrong(const Constraint& constraint) const {
  if (!constraint.accepted) {
    return false;
  }
  Constraint recorded = constraint;
  for (KeyframeId* id : {&recorded.from, &recorded.to}) {
    id->map = maps_[MapIndex(id->map)];
  }
  return HallOf(constraint.from.map) != HallOf(constraint.to.map) || IsOff(recorded);
}

bool City::IsOff(const Constraint& recorded) const {
  const Rigid3 T = truth_.at(recorded.from).Inverse() * truth_.at(recorded.to);
  return recorded.accepted && ((T.t - recorded.T_from_to.t).norm() > kWrong_m ||
                               T.q.angularDistance(recorded.T_from_to.q) > kWrong_rad);
}

void City::SetLook(int map, int hall, std::vector<Keyframe>* keyframes) const {
  const std::optional<int> model = ModelOf(hall);
  const Descriptor own = MaskOf(hall), models = MaskOf(model.value_or(hall));
  const std::map<int32_t, bool>& in_model_cell = landmarks_[map].in_model_cell;
  for (Keyframe& keyframe : *keyframes) {
    for (Corner& corner : keyframe.corners) {
      const auto landmark = in_model_cell.find(corner.landmark_id);
      const bool borrowed = landmark != in_model_cell.end() && landmark->second;
      Flip(borrowed ? models : own, &corner.descriptor);
    }
  }
}

std::vector<Keyframe> City::Walk(int map, int hall, int visit) const {
  const MapId id = At(hall, visit, {maps_[map], 0}).map;
  // Each map has its own seed.
  const uint64_t seed = StableHash(KeyframeId{id, 0}, KeyframeId{id, 0}, 0);
  std::vector<Keyframe> keyframes = VisitAgain(of_map_[map], id.opened_utime, seed);
  for (Keyframe& keyframe : keyframes) {
    keyframe.id.map = id;
  }
  SetLook(map, hall, &keyframes);
  return keyframes;
}

std::vector<Keyframe> City::Walk(int hall, int visit) const { return Walk(0, hall, visit); }

// The recorded verification results, also between this visit and the previous one.
std::vector<Constraint> City::ResultsAt(int hall, int visit, const Step& recorded) const {
  std::vector<Constraint> results;
  for (Constraint result : recorded.results) {
    const KeyframeId from = result.from;
    result.to = At(hall, visit, result.to);
    result.from = At(hall, visit, from);
    results.push_back(result);
    if (visit > 0 && result.accepted && result.kind == PlaceKind::kInter) {
      result.from = At(hall, visit - 1, from);
      results.push_back(result);
    }
  }
  return results;
}

PlaceMatch City::MatchAt(int hall, int visit, const Step& recorded) const {
  PlaceMatch match;
  match.query = At(hall, visit, recorded.match.query);
  const std::vector<Constraint> results = ResultsAt(hall, visit, recorded);
  for (PlaceCandidate candidate : recorded.match.candidates) {
    const KeyframeId place = candidate.match;
    for (const int of_visit : {visit, visit - 1}) {
      candidate.match = At(hall, of_visit, place);
      if (std::ranges::find(results, candidate.match, &Constraint::from) != results.end()) {
        match.candidates.push_back(candidate);
      }
    }
  }
  return match;
}

Constraint City::DoorTo(int hall) const {
  const KeyframeId first{maps_.front(), 0};
  const Rigid3& T_hall_body = truth_.at(first);
  const Rigid3 T_before_hall(Eigen::Quaterniond::Identity(), {kHall_m, 0, 0});
  Constraint door;
  door.from = At(hall - 1, 0, first);
  door.to = At(hall, 0, first);
  door.kind = PlaceKind::kDerived;
  door.accepted = true;
  door.T_from_to = T_hall_body.Inverse() * T_before_hall * T_hall_body;
  door.covariance.topLeftCorner<3, 3>() *= kDoorSigma_m * kDoorSigma_m;
  door.covariance.bottomRightCorner<3, 3>() *= kDoorSigma_rad * kDoorSigma_rad;
  return door;
}

std::vector<Step> City::Visit(int hall, int visit) const {
  std::vector<std::vector<Keyframe>> walks;
  for (size_t map = 0; map < maps_.size(); ++map) {
    walks.push_back(Walk(static_cast<int>(map), hall, visit));
  }
  std::vector<Step> steps;
  for (const Step& recorded : recorded_) {
    const KeyframeId& id = recorded.keyframe.id;
    const auto map = std::ranges::find(maps_, id.map) - maps_.begin();
    steps.push_back({std::move(walks[map][id.seq]), MatchAt(hall, visit, recorded),
                     ResultsAt(hall, visit, recorded)});
  }
  if (options_.joined && hall > 0 && visit == 0) {
    steps.front().results.push_back(DoorTo(hall));
  }
  return steps;
}

}  // namespace pangea::bench
