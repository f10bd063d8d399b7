#include "viewer/scene/update.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>
#include <utility>

namespace pangea::viewer {
namespace {

using nlohmann::json;

static_assert(std::endian::native == std::endian::little);

constexpr double kTimeStep_s = 0.1;
// Approximate size of an item in the JSON text, bytes.
constexpr size_t kItemBytes = 200;

// Rounds to four decimals, because the page does not need 17 digits.
double Rounded(double value) { return std::round(value * 1e4) / 1e4; }

json PoseJson(const Rigid3& T) {
  json pose = json::array();
  for (const double value : {T.t.x(), T.t.y(), T.t.z(), T.q.w(), T.q.x(), T.q.y(), T.q.z()}) {
    pose.push_back(Rounded(value));
  }
  return pose;
}

class Records {
 public:
  void Add(uint32_t value) { Append(&value, sizeof(value)); }
  void Add(float value) { Append(&value, sizeof(value)); }
  void Add(const Rigid3& T) {
    for (const double value : {T.t.x(), T.t.y(), T.t.z(), T.q.w(), T.q.x(), T.q.y(), T.q.z()}) {
      Add(static_cast<float>(value));
    }
  }
  void AddIndex(int64_t value) { Add(static_cast<uint32_t>(value)); }
  void Append(const void* data, size_t size) {
    const size_t at = bytes_.size();
    bytes_.resize(at + size);
    if (size > 0) {
      std::memcpy(bytes_.data() + at, data, size);
    }
  }
  size_t size() const { return bytes_.size(); }
  const std::vector<uint8_t>& bytes() const { return bytes_; }

 private:
  std::vector<uint8_t> bytes_;
};

class Update {
 public:
  explicit Update(const Show& show) : show_(show), scene_(show.scene()) {}

  void Add(const Item& item) {
    ++num_items_;
    const auto index = static_cast<size_t>(item.index);
    switch (item.kind) {
      case ItemKind::kMap:
        AddMap(item.index, scene_.maps()[index]);
        break;
      case ItemKind::kAgent:
        AddAgent(scene_.agents().at(static_cast<int32_t>(item.index)));
        break;
      case ItemKind::kKeyframe:
        AddKeyframe(item.index, scene_.keyframes()[index]);
        break;
      case ItemKind::kSolved:
        AddSolved(item.index, scene_.keyframes()[index]);
        break;
      case ItemKind::kConstraint:
        AddConstraint(item.index, scene_.constraints()[index]);
        break;
      case ItemKind::kProcess:
        AddProcess(scene_.processes()[index]);
        break;
      case ItemKind::kFusion:
        json_["fusions"].push_back(FusionJson(scene_.fusions()[index]));
        break;
      case ItemKind::kAnchor:
        AddAnchor(item.index, scene_.anchors()[index]);
        break;
      case ItemKind::kNotice:
        json_["notice"] = {{"time_s", Rounded(scene_.notice().time_s)},
                           {"text", scene_.notice().text}};
        break;
    }
  }

  void AddView(const SceneAgent& agent) {
    const AgentView& camera = agent.camera;
    const auto& image = camera.image();
    json_["view"] = {{"agent", agent.id},
                     {"width", camera.width()},
                     {"height", camera.height()},
                     {"encoding", image ? image->encoding : 0}};
    const auto tracks = camera.Tracks();
    view_.AddIndex(static_cast<int64_t>(tracks.size()));
    for (const auto& track : tracks) {
      view_.AddIndex(static_cast<int64_t>(track.size()));
      for (const Eigen::Vector2f& pixel : track) {
        view_.Add(pixel.x());
        view_.Add(pixel.y());
      }
    }
    const size_t bytes = image ? image->bytes.size() : 0;
    view_.AddIndex(static_cast<int64_t>(bytes));
    if (image) {
      view_.Append(image->bytes.data(), bytes);
      view_.Append("\0\0\0", (4 - bytes % 4) % 4);
    }
  }

  // The approximate size, bytes.
  size_t size() const { return keyframes_.size() + solved_.size() + kItemBytes * num_items_; }

  void AddClock(bool first) {
    const ShowClock clock = show_.clock();
    json_["now_s"] = Rounded(clock.now_s);
    json_["playing"] = clock.playing;
    json_["speed"] = clock.speed;
    json_["left_out"] = scene_.num_left_out();
    if (first) {
      json all = json::array();
      for (const Fusion& fusion : show_.all_fusions()) {
        all.push_back(FusionJson(fusion));
      }
      json_["start"] = {{"live", clock.live},
                        {"source", show_.source()},
                        {"editable", show_.editable()},
                        {"end_s", clock.end_s},
                        {"all_fusions", std::move(all)}};
    }
  }

  std::vector<uint8_t> Finish(const Seen& seen) {
    json_["epoch"] = seen.epoch;
    json_["version"] = seen.version;
    json_["keyframes"] = num_keyframes_;
    json_["solved"] = num_solved_;
    // Texts from a log or a bus are not always valid UTF-8.
    std::string text = json_.dump(-1, ' ', false, json::error_handler_t::replace);
    text.resize((text.size() + 3) / 4 * 4, ' ');
    Records whole;
    whole.AddIndex(static_cast<int64_t>(text.size()));
    whole.Append(text.data(), text.size());
    whole.Append(keyframes_.bytes().data(), keyframes_.size());
    whole.Append(solved_.bytes().data(), solved_.size());
    whole.Append(view_.bytes().data(), view_.size());
    return whole.bytes();
  }

 private:
  void AddMap(int64_t index, const SceneMap& map) {
    json_["maps"].push_back({{"index", index},
                             {"agent", map.id.agent_id},
                             {"name", ToString(map.id)},
                             {"group", scene_.MapIndex(map.group).value_or(0)},
                             {"T_map_odom", PoseJson(map.T_map_odom)}});
  }

  void AddAgent(const SceneAgent& agent) {
    json said = {{"id", agent.id},
                 {"map", agent.map},
                 {"heard_s", Rounded(agent.heard_s)},
                 {"T_odom_body", PoseJson(agent.T_odom_body)},
                 {"T_body_cam", PoseJson(agent.T_body_cam)},
                 {"view",
                  {Rounded(agent.view[0]), Rounded(agent.view[1]), Rounded(agent.view[2]),
                   Rounded(agent.view[3])}},
                 {"drift_m", Rounded(scene_.DriftOf(agent))}};
    if (agent.pose) {
      said["state"] = agent.pose->state;
      said["reason"] = agent.pose->reason;
      said["num_tracked"] = agent.pose->num_tracked;
    }
    if (const auto covariance = scene_.PositionCovariance(agent)) {
      const Eigen::Matrix3d& c = *covariance;
      said["covariance_m2"] = {c(0, 0), c(0, 1), c(1, 1), c(2, 2)};
    }
    json_["agents"].push_back(std::move(said));
  }

  void AddKeyframe(int64_t index, const SceneKeyframe& keyframe) {
    ++num_keyframes_;
    keyframes_.AddIndex(index);
    keyframes_.AddIndex(keyframe.map);
    keyframes_.AddIndex(keyframe.shown.id.seq);
    keyframes_.AddIndex(static_cast<int64_t>(keyframe.shown.points.size()));
    keyframes_.Add(keyframe.shown.T_odom_body);
    for (const ShownPoint& point : keyframe.shown.points) {
      keyframes_.Add(point.p_body.x());
      keyframes_.Add(point.p_body.y());
      keyframes_.Add(point.p_body.z());
    }
  }

  void AddSolved(int64_t index, const SceneKeyframe& keyframe) {
    const auto group = scene_.MapIndex(keyframe.group);
    if (group && keyframe.T_map_body) {
      ++num_solved_;
      solved_.AddIndex(index);
      solved_.AddIndex(*group);
      solved_.Add(*keyframe.T_map_body);
    }
  }

  void AddConstraint(int64_t index, const Constraint& constraint) {
    const auto end = [&](const KeyframeId& id) {
      return json{scene_.MapIndex(id.map).value_or(-1), id.seq};
    };
    json_["constraints"].push_back(
        {{"index", index},
         {"from", end(constraint.from)},
         {"to", end(constraint.to)},
         {"inter", constraint.kind == PlaceKind::kInter || constraint.kind == PlaceKind::kTag},
         {"accepted", constraint.accepted},
         {"reason", constraint.reason},
         {"inliers", constraint.num_inliers},
         {"inlier_ratio", Rounded(constraint.inlier_ratio)},
         {"rms_px", Rounded(constraint.rms_px)}});
  }

  void AddProcess(const SceneProcess& process) {
    const ProcessHealth& health = process.health;
    json refused = json::array();
    for (const auto& [reason, count] : health.refused) {
      refused.push_back({reason, count});
    }
    json_["processes"].push_back({{"name", health.process},
                                  {"heard_s", Rounded(process.heard_s)},
                                  {"summary", health.summary},
                                  {"pending", health.pending},
                                  {"in", health.messages_in},
                                  {"out", health.messages_out},
                                  {"dropped", health.dropped},
                                  {"resends_asked", health.resends_asked},
                                  {"median_ms", Rounded(health.median_ms)},
                                  {"p99_ms", Rounded(health.p99_ms)},
                                  {"memory_mb", Rounded(health.memory_mb)},
                                  {"cpu_s", Rounded(health.cpu_s)},
                                  {"refused", std::move(refused)}});
  }

  void AddAnchor(int64_t index, const AnchorState& anchor) {
    json said = {{"index", index},
                 {"id", {anchor.anchor.agent_id, anchor.anchor.created_utime}},
                 {"gone", anchor.gone}};
    if (!anchor.gone) {
      // Standard deviation of the position, root mean square over its axes.
      const double sigma_m = std::sqrt(anchor.covariance.topLeftCorner<3, 3>().trace() / 3);
      said.update({{"name", anchor.name},
                   {"revision", anchor.revision},
                   {"edited_by", anchor.edited_by},
                   {"payload_bytes", anchor.payload.size()},
                   {"group", scene_.MapIndex(anchor.map).value_or(-1)},
                   {"T_map_anchor", PoseJson(anchor.T_odom_anchor)},
                   {"sigma_m", Rounded(sigma_m)}});
    }
    json_["anchors"].push_back(std::move(said));
  }

  json FusionJson(const Fusion& fusion) const {
    json agents = json::array();
    for (const MapId& map : fusion.maps) {
      if (std::ranges::find(agents, json(map.agent_id)) == agents.end()) {
        agents.push_back(map.agent_id);
      }
    }
    return {{"time_s", Rounded(fusion.time_s)}, {"fused", fusion.fused}, {"agents", agents}};
  }

  const Show& show_;
  const Scene& scene_;
  json json_ = json::object();
  Records keyframes_;
  Records solved_;
  Records view_;
  size_t num_items_ = 0;
  int num_keyframes_ = 0;
  int num_solved_ = 0;
};

// The watched agent, if its camera view is new to the page; else null.
const SceneAgent* NewView(const Show& show, const Seen& seen) {
  const auto watched = show.scene().agents().find(seen.watched);
  const bool is_new =
      watched != show.scene().agents().end() && watched->second.camera.number() != seen.view;
  return is_new ? &watched->second : nullptr;
}

}  // namespace

bool HasUpdate(const Show& show, const Seen& seen) {
  const ShowClock clock = show.clock();
  return seen.epoch != show.epoch() || seen.version < show.scene().changes().version() ||
         clock.playing != seen.clock.playing || clock.speed != seen.clock.speed ||
         std::abs(clock.now_s - seen.clock.now_s) >= kTimeStep_s || NewView(show, seen) != nullptr;
}

std::vector<uint8_t> EncodeUpdate(const Show& show, size_t budget, Seen* seen) {
  const bool first = seen->epoch != show.epoch();
  if (first) {
    *seen = {show.epoch(), 0, {}, seen->watched, 0};
  }
  seen->clock = show.clock();
  Update update(show);
  update.AddClock(first);
  const auto& by_version = show.scene().changes().by_version();
  for (auto it = by_version.upper_bound(seen->version);
       it != by_version.end() && update.size() < budget; ++it) {
    update.Add(it->second);
    seen->version = it->first;
  }
  if (const SceneAgent* agent = NewView(show, *seen)) {
    update.AddView(*agent);
    seen->view = agent->camera.number();
  }
  return update.Finish(*seen);
}

}  // namespace pangea::viewer
