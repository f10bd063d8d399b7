#include "anchors/api/anchor_json.h"

#include "core/ids.h"

namespace pangea {

using nlohmann::json;

namespace {

ListedAnchor Listed(const Anchors& anchors, const AnchorId& id, const AnchorEntry& entry) {
  if (auto state = anchors.InItsGroup(id)) {
    return {*std::move(state), true};
  }
  ListedAnchor waiting;
  waiting.state.anchor = id;
  waiting.state.revision = entry.revision;
  waiting.state.edited_by = entry.edited_by;
  waiting.state.name = entry.name;
  waiting.state.payload = entry.payload;
  return waiting;
}

json Numbers(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

}  // namespace

std::vector<ListedAnchor> ListAnchors(const Anchors& anchors) {
  std::vector<ListedAnchor> listed;
  for (const auto& [id, entry] : anchors.registry().entries()) {
    if (!entry.deleted) {
      listed.push_back(Listed(anchors, id, entry));
    }
  }
  return listed;
}

std::optional<ListedAnchor> FindAnchor(const Anchors& anchors, const AnchorId& id) {
  const auto entry = anchors.registry().entries().find(id);
  if (entry == anchors.registry().entries().end() || entry->second.deleted) {
    return std::nullopt;
  }
  return Listed(anchors, id, entry->second);
}

json ToJson(const ListedAnchor& anchor) {
  const AnchorState& state = anchor.state;
  json said = {{"id", ToString(state.anchor)},
               {"revision", state.revision},
               {"name", state.name},
               {"payload", state.payload},
               {"made_by", state.anchor.agent_id},
               {"edited_by", state.edited_by},
               {"deleted", false},
               {"group", nullptr},
               {"group_revision", 0},
               {"pose", nullptr},
               {"sigma_m", nullptr},
               {"sigma_rad", nullptr}};
  if (anchor.placed) {
    const Eigen::Quaterniond& q = state.T_odom_anchor.q;
    const Vector6d sigma = state.covariance.diagonal().cwiseSqrt();
    said["group"] = ToString(state.group);
    said["group_revision"] = state.group_revision;
    said["pose"] = {{"position", Numbers(state.T_odom_anchor.t)},
                    {"orientation", {q.w(), q.x(), q.y(), q.z()}}};
    said["sigma_m"] = Numbers(sigma.head<3>());
    said["sigma_rad"] = Numbers(sigma.tail<3>());
  }
  return said;
}

std::string ToText(const json& value) {
  return value.dump(-1, ' ', false, json::error_handler_t::replace);
}

}  // namespace pangea
