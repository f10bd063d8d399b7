#include "report/expectations.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <stdexcept>
#include <string_view>

namespace pangea::session {
namespace {

using nlohmann::ordered_json;

enum class Relation : uint8_t { kExactly, kAtMost, kAtLeast };

// A value of the session, or one of each agent.
struct Value {
  std::string of;  // "agent 2: "; empty for the session's
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

// The first fusion that all agents were in, and have not left since.
Values FusedBy(const ordered_json& report) {
  std::set<int32_t> all;
  for (const ordered_json& agent : report.at("agents")) {
    all.insert(agent.at("id").get<int32_t>());
  }
  std::optional<double> since;
  for (const ordered_json& change : report.at("fused_at")) {
    if (change.at("change") != "fused") {
      since.reset();
    } else if (!since && Agents(change) == all) {
      since = Number(change.at("session_s"));
    }
  }
  const bool together = !report.at("groups").empty() && Agents(report.at("groups").front()) == all;
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
    return std::optional(static_cast<double>(agent.at("map_ids").size()));
  });
}

template <const char* kKey>
Values Each(const ordered_json& report) {
  return OfEach(report, [](const ordered_json& agent) { return Number(agent.at(kKey)); });
}

Values Joint(const ordered_json& report) { return {{"", Number(report.at("ate_joint_m"))}}; }

Values Wrong(const ordered_json& report) {
  const ordered_json& truth = report.at("constraints_truth");
  // Nothing was checked: nothing is known.
  const bool any = truth.at("checked").get<int64_t>() > 0;
  return {{"", any ? Number(truth.at("wrong")) : std::nullopt}};
}

constexpr char kCoverage[] = "coverage";
constexpr char kAteVio[] = "ate_vio_m";
constexpr char kAteServer[] = "ate_server_m";

struct Kind {
  std::string_view name;
  Relation relation;
  std::string_view unit;
  Values (*metrics)(const ordered_json& report);
};

constexpr std::array kKinds = {
    Kind{"groups", Relation::kExactly, "", Groups},
    Kind{"fused_by", Relation::kAtMost, " s", FusedBy},
    Kind{"maps", Relation::kAtMost, "", Maps},
    Kind{kCoverage, Relation::kAtLeast, "", Each<kCoverage>},
    Kind{kAteVio, Relation::kAtMost, " m", Each<kAteVio>},
    Kind{kAteServer, Relation::kAtMost, " m", Each<kAteServer>},
    Kind{"ate_joint_m", Relation::kAtMost, " m", Joint},
    Kind{"wrong_constraints", Relation::kAtMost, "", Wrong},
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
                    value.value ? fmt::format("{:.4g}{}", *value.value, kind.unit) : "none");
    checked.met &= value.value && Met(kind.relation, bound, *value.value);
  }
  if (metrics.empty()) {
    checked.value = "none";
    checked.met = false;
  }
  return checked;
}

}  // namespace

ExpectationsSection::ExpectationsSection(YamlOptions& yaml, const std::string& key) {
  YamlOptions& section = yaml.Section(key);
  for (const Kind& kind : kKinds) {
    const std::string name(kind.name);
    section.Add(name, &bounds_[name]);
  }
}

Expectations ExpectationsSection::Take(const std::string& file) const {
  Expectations expectations;
  for (const auto& [name, bound] : bounds_) {
    if (bound && !(*bound >= 0 && std::isfinite(*bound))) {
      throw std::runtime_error(fmt::format(
          "{}: expect: {} is no bound of {}: give a number from 0 up", file, *bound, name));
    }
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

}  // namespace pangea::session
