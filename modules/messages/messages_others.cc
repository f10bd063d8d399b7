#include "messages/messages.h"
#include "messages/messages_checks.h"

namespace pangea {

using namespace messages_checks;

namespace {

constexpr int32_t kMaxAgentId = 65535;

}  // namespace

others_t ToMessage(const Others& others) {
  others_t m{};
  m.map = ToMessage(others.map);
  for (const OtherAgent& other : others.others) {
    other_agent_t o{};
    o.agent_id = other.agent_id;
    o.T_odom_cam = ToMessage(other.T_odom_cam);
    m.others.push_back(o);
  }
  m.num_others = static_cast<int8_t>(m.others.size());
  return m;
}

Parsed<Others> Parse(const others_t& m) {
  const auto map = Parse(m.map);
  if (!map.value || m.num_others < 0 || m.num_others > int{kMaxOthers}) {
    return Refused<Others>("others: invalid map, or too many of them");
  }
  Others others{*map.value, {}};
  for (const other_agent_t& o : m.others) {
    const auto T_odom_cam = Parse(o.T_odom_cam);
    if (!T_odom_cam.value || o.agent_id < 1 || o.agent_id > kMaxAgentId ||
        o.agent_id == others.map.agent_id) {
      return Refused<Others>("others: invalid agent or pose");
    }
    others.others.push_back({o.agent_id, *T_odom_cam.value});
  }
  return {std::move(others), ""};
}

}  // namespace pangea
