#include "anchors/api/anchor_api.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>

#include "anchors/api/answers.h"
#include "anchors/api/openapi_text.h"

namespace pangea {

using namespace anchor_answers;

namespace {

using nlohmann::json;
using web::WebAnswer;

// Further away from all keyframes, a small rotation would displace the anchor too far.
constexpr double kMaxFromKeyframe_m = 1000;
// A keyframe that is on its way is not so much newer: the time has another unit or clock.
constexpr int64_t kMaxAhead_us = 86'400'000'000;

std::string NoGroup(const MapId& group) {
  return fmt::format(
      "{} is no group of maps: /v1/agents has those there are; a fusion gives a group the id of "
      "its oldest map",
      ToString(group));
}

}  // namespace

void AnchorApi::Tick(int64_t now_utime, bool complete) {
  now_utime_ = now_utime;
  complete_ = complete;
  feed_.SetNow(now_utime);
  for (auto it = pending_.begin(); it != pending_.end();) {
    if (now_utime >= it->timeout_utime) {
      const Pending late = std::move(*it);
      it = pending_.erase(it);
      late.reply(Json(503, {{"error",
                             "the journal did not confirm this edit in 5 s: it may still get it, "
                             "look before you send it again; does pangea-agent-handler run?"},
                            {"id", ToString(late.edit.anchor)}}));
      continue;
    }
    if (now_utime >= it->next_utime) {
      it->next_utime = now_utime + kRepeat_us;
      request_(it->edit);
    }
    ++it;
  }
}

void AnchorApi::Take(const AnchorEdit& edit, const std::string& refused) {
  const auto requested = requested_.find(edit.anchor);
  if (requested != requested_.end() && edit.revision >= requested->second) {
    requested_.erase(requested);
  }
  const auto ours = std::ranges::find_if(pending_, [&](const Pending& pending) {
    return pending.edit.anchor == edit.anchor && pending.edit.revision == edit.revision &&
           pending.edit.agent_id == edit.agent_id;
  });
  if (ours != pending_.end()) {
    const Pending done = std::move(*ours);
    pending_.erase(ours);
    done.reply(Outcome(done.edit, edit, refused));
  }
}

WebAnswer AnchorApi::Outcome(const AnchorEdit& ours, const AnchorEdit& journalled,
                             const std::string& refused) const {
  if (!refused.empty()) {
    return Error(409, refused);
  }
  if (ours.deleted && journalled.deleted) {
    return {204, "", ""};
  }
  const auto anchor = FindAnchor(anchors_, ours.anchor);
  if (!anchor) {
    return Error(410, "somebody deleted this anchor meanwhile");
  }
  if (!IsSameChange(ours, journalled) || anchor->state.edited_by != ours.agent_id ||
      anchor->state.revision != ours.revision) {
    return Error(409, fmt::format("agent {} changed this anchor meanwhile: it has revision {} now",
                                  anchor->state.edited_by, anchor->state.revision));
  }
  if (ours.revision > 1) {
    return OneAnchor(200, *anchor);
  }
  WebAnswer answer = OneAnchor(201, *anchor);
  answer.headers.emplace_back("Location", "/v1/anchors/" + ToString(ours.anchor));
  return answer;
}

void AnchorApi::Answer(const web::WebRequest& request, Reply reply) {
  const size_t question = std::min(request.target.find('?'), request.target.size());
  const Path path = SplitPath(PercentDecoded(request.target.substr(0, question)));
  const std::string query = request.target.substr(std::min(question + 1, request.target.size()));
  const bool is_get = request.method == "GET";
  const Path root(path.begin(), path.begin() + std::min<std::ptrdiff_t>(2, std::ssize(path)));
  if (path == Path{"v1", "openapi.json"}) {
    return reply(is_get ? WebAnswer{200, "application/json", kOpenApiText} : OnlyMethods("GET"));
  }
  if (path == Path{"v1", "events"}) {
    return reply(is_get ? Error(426, "this is a WebSocket: ws://.../v1/events")
                        : OnlyMethods("GET"));
  }
  const bool is_anchors = root == Path{"v1", "anchors"} && (path.size() == 2 || path.size() == 4);
  const bool is_agents = path == Path{"v1", "agents"};
  const bool is_anchors_of_agent =
      root == Path{"v1", "agents"} && path.size() == 4 && path[3] == "anchors";
  if (!is_anchors && !is_agents && !is_anchors_of_agent) {
    return reply(Error(404, "there is nothing here: /v1/openapi.json has what there is"));
  }
  if (!complete_) {
    WebAnswer starting = Error(503, "the journal is still being read: try again in a second");
    starting.headers = {{"Retry-After", "1"}};
    return reply(starting);
  }
  if (is_anchors) {
    return path.size() == 2 ? AnswerAnchors(request, query, reply)
                            : AnswerAnchor(request, path, reply);
  }
  if (!is_get) {
    return reply(OnlyMethods("GET"));
  }
  reply(is_agents ? Agents() : AnchorsOfAgent(path[2]));
}

std::unique_ptr<web::WebPeer> AnchorApi::Open(const web::WebRequest& request) {
  return request.target == "/v1/events" ? std::make_unique<AnchorListener>(feed_) : nullptr;
}

void AnchorApi::AnswerAnchors(const web::WebRequest& request, const std::string& query,
                              const Reply& reply) {
  if (request.method == "GET") {
    reply(List(query));
  } else if (request.method == "POST") {
    Make(request, reply);
  } else {
    reply(OnlyMethods("GET, POST"));
  }
}

void AnchorApi::AnswerAnchor(const web::WebRequest& request, const Path& path, const Reply& reply) {
  const auto id = ParseAnchorId(path[2], path[3]);
  const auto& entries = anchors_.registry().entries();
  if (!id || !entries.contains(*id)) {
    return reply(Error(404, "there is no such anchor"));
  }
  const auto anchor = FindAnchor(anchors_, *id);
  if (!anchor) {
    return reply(Error(410, "this anchor was deleted"));
  }
  if (request.method == "GET") {
    reply(OneAnchor(200, *anchor));
  } else if (request.method == "PUT" || request.method == "DELETE") {
    Change(request, *anchor, reply);
  } else {
    reply(OnlyMethods("GET, PUT, DELETE"));
  }
}

WebAnswer AnchorApi::List(const std::string& query) const {
  std::optional<MapId> group;
  if (!query.empty()) {
    const std::string name = "group=";
    group = query.starts_with(name) ? ParseMapId(PercentDecoded(query.substr(name.size())))
                                    : std::nullopt;
    if (!group) {
      return Error(BadField{"group", "give ?group=AGENT/OPENED_UTIME, a group's id"});
    }
    if (!anchors_.HasGroup(*group)) {
      return Error(404, NoGroup(*group));
    }
  }
  json anchors = json::array();
  for (const ListedAnchor& anchor : ListAnchors(anchors_)) {
    if (!group || (anchor.placed && anchor.state.group == *group)) {
      anchors.push_back(ToJson(anchor));
    }
  }
  return Json(200, {{"anchors", std::move(anchors)}});
}

WebAnswer AnchorApi::Agents() const {
  json agents = json::array();
  for (const MapId& map : anchors_.AgentMaps()) {
    const auto [group, revision] = anchors_.GroupAndRevision(map);
    agents.push_back({{"id", map.agent_id},
                      {"map", ToString(map)},
                      {"group", ToString(group)},
                      {"group_revision", revision}});
  }
  return Json(200, {{"agents", std::move(agents)}});
}

WebAnswer AnchorApi::AnchorsOfAgent(const std::string& agent) const {
  const auto agent_id = ParseNumber(agent, 65535);
  const std::vector<MapId> maps = anchors_.AgentMaps();
  const auto map =
      std::ranges::find_if(maps, [&](const MapId& id) { return id.agent_id == agent_id; });
  if (map == maps.end()) {
    return Error(404, "the server has no map of this agent: /v1/agents has those there are");
  }
  json anchors = json::array();
  for (AnchorState& state : anchors_.ForAgent(*map)) {
    if (!state.gone) {
      anchors.push_back(ToJson({std::move(state), true}));
    }
  }
  return Json(200, {{"map", ToString(*map)}, {"anchors", std::move(anchors)}});
}

void AnchorApi::Make(const web::WebRequest& request, const Reply& reply) {
  const auto parsed = ParseEditBody(request.body, BodyOf::kNew);
  if (const auto* const bad = std::get_if<BadField>(&parsed)) {
    return reply(Error(*bad));
  }
  // The journal would keep an edit that is refused later, and a server with another limit take it.
  const size_t num_anchors = anchors_.num_anchors() + NumPendingNew();
  if (num_anchors >= max_anchors_) {
    return reply(
        Error(409, fmt::format("there are {} anchors, max_anchors: delete some", num_anchors)));
  }
  const auto& body = std::get<EditBody>(parsed);
  AnchorEdit edit;
  edit.name = body.name.value_or("");
  edit.payload = body.payload.value_or("");
  if (const BadField bad = SetPose(*body.pose, &edit); !bad.error.empty()) {
    return reply(Error(bad));
  }
  edit.anchor = NewId();
  Submit(std::move(edit), reply);
}

size_t AnchorApi::NumPendingNew() const {
  return static_cast<size_t>(std::ranges::count_if(
      pending_, [](const Pending& pending) { return pending.edit.revision == 1; }));
}

void AnchorApi::Change(const web::WebRequest& request, const ListedAnchor& anchor,
                       const Reply& reply) {
  const AnchorId id = anchor.state.anchor;
  AnchorEdit edit;
  edit.anchor = id;
  edit.name = NameOf(anchor.state);
  edit.payload = anchor.state.payload;
  // An edit states the whole anchor: so also what a change that is under way will have changed.
  const auto under_way = std::find_if(pending_.rbegin(), pending_.rend(), [&](const Pending& p) {
    return p.edit.anchor == id && !p.edit.deleted;
  });
  if (under_way != pending_.rend()) {
    edit.name = under_way->edit.name;
    edit.payload = under_way->edit.payload;
  }
  edit.deleted = request.method == "DELETE";
  std::optional<int64_t> known;
  if (edit.deleted && !request.body.empty()) {
    return reply(Error(BadField{"", "DELETE takes no body: give the revision as If-Match"}));
  }
  if (!edit.deleted) {
    const auto parsed = ParseEditBody(request.body, BodyOf::kChange);
    if (const auto* const bad = std::get_if<BadField>(&parsed)) {
      return reply(Error(*bad));
    }
    const auto& body = std::get<EditBody>(parsed);
    known = body.revision;
    edit.name = body.name.value_or(edit.name);
    edit.payload = body.payload.value_or(edit.payload);
    if (const BadField bad = body.pose ? SetPose(*body.pose, &edit) : BadField();
        !bad.error.empty()) {
      return reply(Error(bad));
    }
  }
  if (const BadField bad = TakeIfMatch(request.if_match, &known); !bad.error.empty()) {
    return reply(Error(bad));
  }
  if (known && *known != anchor.state.revision) {
    return reply(Error(409, fmt::format("you know revision {}, the newest is {}: look again",
                                        *known, anchor.state.revision)));
  }
  if (known && std::ranges::count(pending_, id, [](const Pending& p) { return p.edit.anchor; })) {
    return reply(Error(409, "another change of this anchor is under way: look again"));
  }
  const auto requested = requested_.find(id);
  edit.revision =
      1 + (requested == requested_.end() ? anchor.state.revision
                                         : std::max(anchor.state.revision, requested->second));
  Submit(std::move(edit), reply);
}

BadField AnchorApi::SetPose(const BodyPose& pose, AnchorEdit* edit) const {
  BadField bad = std::visit([&](const auto& one) { return SetPose(one, edit); }, pose);
  if (!bad.error.empty()) {
    return bad;
  }
  const PlacementResult placed = anchors_.Try(*edit);
  const auto* const not_placed = std::get_if<NotPlaced>(&placed);
  return not_placed == nullptr ? BadField() : BadField{"pose", not_placed->reason};
}

BadField AnchorApi::SetPose(const PoseInGroup& pose, AnchorEdit* edit) const {
  const auto nearest = anchors_.NearestKeyframe(pose.group, pose.T_map_anchor.t);
  if (!nearest) {
    return {"pose.group", NoGroup(pose.group)};
  }
  edit->placement = AnchorEdit::Placement::kKeyframe;
  edit->map = nearest->id.map;
  edit->keyframe_seq = nearest->id.seq;
  edit->T_ref_anchor = nearest->T_map_body.Inverse() * pose.T_map_anchor;
  if (edit->T_ref_anchor.t.norm() > kMaxFromKeyframe_m) {
    return {"pose.position",
            fmt::format("is more than {} m from where any agent has been", kMaxFromKeyframe_m)};
  }
  anchors_.MakeExact(edit);
  return {};
}

BadField AnchorApi::SetPose(const PoseByKeyframe& pose, AnchorEdit* edit) const {
  edit->placement = AnchorEdit::Placement::kKeyframe;
  edit->map = pose.keyframe.map;
  edit->keyframe_seq = pose.keyframe.seq;
  edit->T_ref_anchor = pose.T_body_anchor;
  if (std::holds_alternative<AwaitsKeyframe>(anchors_.Try(*edit))) {
    return {"pose.keyframe", fmt::format("the server has no keyframe {}", ToString(pose.keyframe))};
  }
  if (edit->T_ref_anchor.t.norm() > kMaxFromKeyframe_m) {
    return {"pose.position", fmt::format("give {} m at most", kMaxFromKeyframe_m)};
  }
  return {};
}

BadField AnchorApi::SetPose(const PoseBehindPixel& pose, AnchorEdit* edit) const {
  const std::vector<MapId> maps = anchors_.AgentMaps();
  const auto map =
      std::ranges::find_if(maps, [&](const MapId& id) { return id.agent_id == pose.agent_id; });
  if (map == maps.end()) {
    return {"pose.agent", "the server has no map of this agent: /v1/agents has those there are"};
  }
  const TrackedKeyframe* const newest = anchors_.NewestKeyframe(*map);
  if (newest != nullptr && pose.utime - newest->utime > kMaxAhead_us) {  // it would wait for ever
    return {"pose.utime",
            "is more than a day after the agent's newest keyframe: give microseconds of its "
            "sensor clock"};
  }
  if (newest != nullptr && !newest->camera->Contains(pose.pixel)) {
    return {"pose.pixel", fmt::format("is outside the agent's image, which has {} x {} pixels",
                                      newest->camera->width, newest->camera->height)};
  }
  edit->placement = AnchorEdit::Placement::kPixel;
  edit->map = *map;
  edit->utime = pose.utime;
  edit->pixel = pose.pixel;
  return {};
}

// The id is the time, made unique even if the clock goes back.
AnchorId AnchorApi::NewId() {
  AnchorId id{0, std::max(now_utime_, newest_created_utime_ + 1)};
  while (anchors_.registry().entries().contains(id)) {
    ++id.created_utime;
  }
  newest_created_utime_ = id.created_utime;
  return id;
}

void AnchorApi::Submit(AnchorEdit edit, const Reply& reply) {
  if (pending_.size() >= kMaxPending) {
    return reply(Error(503, "too many edits are under way: try again in a second"));
  }
  if (edit.revision > 1) {
    requested_[edit.anchor] = edit.revision;
  }
  request_(edit);
  pending_.push_back({std::move(edit), reply, now_utime_ + kRepeat_us, now_utime_ + kTimeout_us});
}

}  // namespace pangea
