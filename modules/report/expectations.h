#pragma once

// Expectations of a session: bounds on the metrics of its report, so that a session can be a test
// with an exit code.
//
//   expect: {groups: 1, fused_by: 40, ate_joint_m: 0.1}
//
//   groups              as many groups of fused maps at the end
//   fused_by            at most: seconds, since the capture began, until all agents are in one
//                       group until the end
//   maps                at most, each agent: a new map is opened when tracking was lost
//   coverage            at least, each agent
//   ate_vio_m, ate_server_m  at most, each agent
//   ate_joint_m         at most
//   wrong_constraints   at most: accepted, and not so by the ground truth
//   anchor_error_m, anchor_error_px, anchor_largest_jump_m
//                       at most, each anchor at each other agent of its group
//
// The metrics are those in report.json (docs/report.md). A missing metric (no ground truth or no
// fusion) does not meet its bound. A replay's report has all of them except those of anchors.

#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "eval/table.h"
#include "options/yaml_options.h"

namespace pangea {

// Bounds by name.
using Expectations = std::map<std::string, double>;

// The section `key` of a session file.
class ExpectationsSection {
 public:
  ExpectationsSection(YamlOptions& yaml, const std::string& key);
  // The bounds that were read.
  Expectations Take() const;

 private:
  std::map<std::string, std::optional<double>> bounds_;
};

struct CheckedExpectation {
  std::string name;
  double bound = 0;
  std::string text;   // "at most 40 s"
  std::string value;  // "21.3 s"; "agent 1: 0.02, agent 2: none"
  bool met = false;
};

// Checks the metrics in a report.json.
std::vector<CheckedExpectation> Check(const Expectations& expectations,
                                      const nlohmann::ordered_json& report);

// ToTable is for report.md and report.html, ToJson for report.json.
Table ToTable(const std::vector<CheckedExpectation>& checked);
nlohmann::ordered_json ToJson(const std::vector<CheckedExpectation>& checked);

}  // namespace pangea
