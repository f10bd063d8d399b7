#include "report/expectations.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <set>
#include <string_view>

namespace pangea {
namespace {

using nlohmann::ordered_json;

enum class Relation : uint8_t { kExactly, kAtMost, kAtLeast };

// A value of the session, or of one agent.
struct Value {
  std::string of;  // "agent 2: "; empty for the session
  std::optional<double> value;
};
using Values = std::vector<Value>;

std::optional<double> Number(const ordered_json& value) {
  return value.is_number() ? std::optional(value.get<double>()) : std::nullopt;
}

Values Groups(const ordered_json& report) {
  return {{"", static_cast<double>(report.at("groups").size())}};
}

std::set<int32_t> Agents(const ordered_json& group) {
  return group.at("agents").get<std::set<int32_t>>();
}

// The maps of its agents that are of earlier sessions.
std::set<std::string> EarlierMaps(const ordered_json& report) {
  std::set<std::string> maps;
  for (const ordered_json& agent : report.at("agents")) {
    maps.merge(agent.at("map_ids_not_compared").get<std::set<std::string>>());
  }
  return maps;
}

// Whether one group has maps of all these agents, and perhaps of agents of earlier sessions.
// `group_of`: by map, "AGENT/OPENED".
bool Together(const std::map<std::string, size_t>& group_of, const std::set<int32_t>& agents) {
  std::map<size_t, std::set<int32_t>> groups;
  for (const auto& [map, group] : group_of) {
    groups[group].insert(std::stoi(map));
  }
  return std::ranges::any_of(
      groups, [&agents](const auto& group) { return std::ranges::includes(group.second, agents); });
}

// The time of the first fusion of all agents after which none has left the group. A map may leave
// it, if its agent has another one there.
Values FusedBy(const ordered_json& report) {
  std::set<int32_t> all;
  for (const ordered_json& agent : report.at("agents")) {
    all.insert(agent.at("id").get<int32_t>());
  }
  const std::set<std::string> earlier = EarlierMaps(report);
  std::optional<double> since;
  std::map<std::string, size_t> group_of;
  size_t group = 0;
  for (const ordered_json& change : report.at("fused_at")) {
    ++group;
    for (const ordered_json& id : change.at("map_ids")) {
      if (const auto map = id.get<std::string>(); !earlier.contains(map)) {
        group_of[map] = group;
      }
    }
    if (!Together(group_of, all)) {
      since.reset();
    } else if (!since) {
      since = Number(change.at("session_s"));
    }
  }
  const bool together = !report.at("groups").empty() &&
                        std::ranges::includes(Agents(report.at("groups").front()), all);
  return {{"", together ? since : std::nullopt}};
}

template <typename Of>
Values OfEach(const ordered_json& report, Of of) {
  Values metrics;
  for (const ordered_json& agent : report.at("agents")) {
    metrics.push_back({fmt::format("agent {}: ", agent.at("id").get<int32_t>()), of(agent)});
  }
  return metrics;
}

Values Maps(const ordered_json& report) {
  return OfEach(report, [](const ordered_json& agent) {
    const size_t earlier = agent.at("map_ids_not_compared").size();
    return std::optional(static_cast<double>(agent.at("map_ids").size() - earlier));
  });
}

template <const char* kKey>
Values Each(const ordered_json& report) {
  return OfEach(report, [](const ordered_json& agent) { return Number(agent.at(kKey)); });
}

Values Joint(const ordered_json& report) { return {{"", Number(report.at("ate_joint_m"))}}; }

Values Wrong(const ordered_json& report) {
  const ordered_json& truth = report.at("constraints_truth");
  // If no constraint was checked, the value is unknown.
  const bool any = truth.at("checked").get<int64_t>() > 0;
  return {{"", any ? Number(truth.at("wrong")) : std::nullopt}};
}

constexpr char kAnchorError[] = "error_m";
constexpr char kAnchorPixels[] = "error_px";
constexpr char kAnchorJump[] = "largest_jump_m";

// A value for each other agent of the anchor's group. An anchor that none of them could show has no
// value. If an agent shows an anchor but never has it in view, there is no pixel error, and the
// bound is met.
template <const char* kKey>
Values EachAnchor(const ordered_json& report) {
  Values metrics;
  for (const ordered_json& anchor : report.at("anchors")) {
    const auto name = anchor.at("name").get<std::string>();
    for (const ordered_json& agent : anchor.at("agents")) {
      const bool unseen = kKey == kAnchorPixels && agent.at(kKey).is_null();
      if (unseen && agent.at(kAnchorError).is_number()) {
        continue;
      }
      metrics.push_back({fmt::format("{} at agent {}: ", name, agent.at("id").get<int32_t>()),
                         Number(agent.at(kKey))});
    }
    if (anchor.at("agents").empty()) {
      metrics.push_back({fmt::format("{}: ", name), std::nullopt});
    }
  }
  return metrics;
}

constexpr char kCoverage[] = "coverage";
constexpr char kAteVio[] = "ate_vio_m";
constexpr char kAteServer[] = "ate_server_m";

struct Kind {
  std::string_view name;
  Relation relation;
  std::string_view unit;
  double most;  // largest bound allowed
  Values (*metrics)(const ordered_json& report);
};

constexpr std::array kKinds = {
    Kind{"groups", Relation::kExactly, "", 1e6, Groups},
    Kind{"fused_by", Relation::kAtMost, " s", 1e6, FusedBy},
    Kind{"maps", Relation::kAtMost, "", 1e6, Maps},
    Kind{kCoverage, Relation::kAtLeast, "", 1, Each<kCoverage>},
    Kind{kAteVio, Relation::kAtMost, " m", 1e6, Each<kAteVio>},
    Kind{kAteServer, Relation::kAtMost, " m", 1e6, Each<kAteServer>},
    Kind{"ate_joint_m", Relation::kAtMost, " m", 1e6, Joint},
    Kind{"wrong_constraints", Relation::kAtMost, "", 1e6, Wrong},
    Kind{"anchor_error_m", Relation::kAtMost, " m", 1e6, EachAnchor<kAnchorError>},
    Kind{"anchor_error_px", Relation::kAtMost, " px", 1e6, EachAnchor<kAnchorPixels>},
    Kind{"anchor_largest_jump_m", Relation::kAtMost, " m", 1e6, EachAnchor<kAnchorJump>},
};

bool Met(Relation relation, double bound, double value) {
  switch (relation) {
    case Relation::kExactly:
      return value == bound;
    case Relation::kAtMost:
      return value <= bound;
    case Relation::kAtLeast:
      return value >= bound;
  }
  return false;
}

std::string BoundText(const Kind& kind, double bound) {
  const char* relation = kind.relation == Relation::kAtMost    ? "at most "
                         : kind.relation == Relation::kAtLeast ? "at least "
                                                               : "";
  return fmt::format("{}{:g}{}", relation, bound, kind.unit);
}

CheckedExpectation CheckOne(const Kind& kind, double bound, const Values& metrics) {
  CheckedExpectation checked{std::string(kind.name), bound, BoundText(kind, bound), "", true};
  for (const Value& value : metrics) {
    checked.value +=
        fmt::format("{}{}{}", checked.value.empty() ? "" : ", ", value.of,
                    value.value ? fmt::format("{:.4g}{}", *value.value, kind.unit) : "no value");
    checked.met &= value.value && Met(kind.relation, bound, *value.value);
  }
  if (metrics.empty()) {
    checked.value = "no value";
    checked.met = false;
  }
  return checked;
}

}  // namespace

ExpectationsSection::ExpectationsSection(YamlOptions& yaml, const std::string& key) {
  YamlOptions& section = yaml.Section(key);
  for (const Kind& kind : kKinds) {
    const std::string name(kind.name);
    section.AddBetween(name, 0, kind.most, &bounds_[name]);
  }
}

Expectations ExpectationsSection::Take() const {
  Expectations expectations;
  for (const auto& [name, bound] : bounds_) {
    if (bound) {
      expectations.emplace(name, *bound);
    }
  }
  return expectations;
}

std::vector<CheckedExpectation> Check(const Expectations& expectations,
                                      const ordered_json& report) {
  std::vector<CheckedExpectation> checked;
  for (const Kind& kind : kKinds) {
    if (const auto given = expectations.find(std::string(kind.name)); given != expectations.end()) {
      checked.push_back(CheckOne(kind, given->second, kind.metrics(report)));
    }
  }
  return checked;
}

Table ToTable(const std::vector<CheckedExpectation>& checked) {
  Table table({"expected", "bound", "value", "result"});
  for (const CheckedExpectation& one : checked) {
    table.Add({one.name, one.text, one.value, one.met ? "met" : "MISSED"});
  }
  return table;
}

ordered_json ToJson(const std::vector<CheckedExpectation>& checked) {
  ordered_json json = ordered_json::array();
  for (const CheckedExpectation& one : checked) {
    json.push_back(
        {{"name", one.name}, {"bound", one.bound}, {"value", one.value}, {"met", one.met}});
  }
  return json;
}

}  // namespace pangea
