#include "log_tools/explain.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <optional>
#include <set>
#include <stdexcept>

#include "core/median.h"
#include "log_file/log_reader.h"
#include "loop_verification/loop_verifier.h"
#include "messages/channels.h"
#include "messages/encoding.h"
#include "messages/messages.h"
#include "server_options/server_options.h"

namespace pangea {
namespace {

Constraint FindResult(const std::string& log, int64_t id, LogReadings* readings) {
  std::optional<Constraint> found;
  const auto find = [&](const LogEvent& event) {
    if (event.channel == channels::kConstraint) {
      if (auto constraint = ParseMessage<constraint_t>(event.data).value;
          constraint && constraint->Id() == id) {
        found = std::move(constraint);
      }
    }
  };
  ReadLog(log, find, readings);
  if (!found) {
    throw std::runtime_error(
        fmt::format("{}: no constraint {}; pangea-log explain {} lists them", log, id, log));
  }
  return *found;
}

PlaceCandidate FindCandidate(const std::string& log, const Constraint& constraint,
                             LogReadings* readings) {
  if (constraint.kind == PlaceKind::kDerived) {
    throw std::runtime_error(fmt::format(
        "{}: constraint {} has no candidate: it stands for those of keyframes that were thinned "
        "away; pangea-log explain {} lists the others",
        log, constraint.Id(), log));
  }
  std::optional<PlaceCandidate> found;
  const auto find = [&](const LogEvent& event) {
    const auto match = event.channel == channels::kPlaceMatch
                           ? ParseMessage<place_match_t>(event.data).value
                           : std::nullopt;
    if (!match || match->query != constraint.to) {
      return;
    }
    for (const PlaceCandidate& candidate : match->candidates) {
      if (candidate.match == constraint.from && candidate.kind == constraint.kind) {
        found = candidate;
      }
    }
  };
  ReadLog(log, find, readings);
  if (!found) {
    throw std::runtime_error(fmt::format(
        "{}: no PLACE_MATCH of {} with {} in this log: replay it, and explain the replay's log",
        log, ToString(constraint.to), ToString(constraint.from)));
  }
  return *found;
}

// Median reprojection error of the inliers, for people.
std::string MissOf(const std::vector<ShownMatch>& matches, double ShownMatch::*miss) {
  std::vector<double> values;
  for (const ShownMatch& match : matches) {
    if (match.inlier) {
      values.push_back(match.*miss);
    }
  }
  return values.empty() ? "-" : fmt::format("{:.1f}", Median(std::move(values)));
}

std::string CountOf(const std::vector<ShownMatch>& matches) {
  const auto inliers = std::ranges::count(matches, true, &ShownMatch::inlier);
  return fmt::format("{} of {} inliers", inliers, matches.size());
}

// The process' options that differ from the defaults, or why they are the defaults.
std::vector<std::string> NotesOf(const LoggedOptions& logged, const std::string& process) {
  std::vector<std::string> notes = logged.notes;
  for (const std::string& other : OtherThanDefault(logged.options)) {
    if (other.starts_with(process + ".")) {
      notes.push_back(fmt::format("options of the log: {}", other));
    }
  }
  return notes;
}

std::unique_ptr<LoopVerifier> VerifierOf(PlaceKind kind, const LoggedOptions& logged,
                                         Explanation* explanation) {
  const bool intra = kind == PlaceKind::kIntra;
  explanation->options_notes = NotesOf(logged, intra ? "inter_map_ba" : "fusion");
  return std::make_unique<LoopVerifier>(intra ? logged.options.inter_map_ba
                                              : logged.options.fusion);
}

double Degrees(double radians) { return radians * 180 / std::numbers::pi; }

std::string WindowBaText(const Explanation& e) {
  const Constraint& c = e.again;
  const Vector6d sigma = c.covariance.diagonal().cwiseSqrt();
  return fmt::format(
      "window BA    {} in the two keyframes; {} observations\n"
      "             inliers miss by {} px at PnP's pose, {} px after (median)\n"
      "uncertainty  {:.3f} {:.3f} {:.3f} m, {:.2f} {:.2f} {:.2f} degrees\n"
      "pose         {:.3f} {:.3f} {:.3f} m, {:.1f} degrees from match to query\n",
      CountOf(e.report.found), c.num_inliers, MissOf(e.report.found, &ShownMatch::miss_before_px),
      MissOf(e.report.found, &ShownMatch::miss_after_px), sigma[0], sigma[1], sigma[2],
      Degrees(sigma[3]), Degrees(sigma[4]), Degrees(sigma[5]), c.T_from_to.t.x(), c.T_from_to.t.y(),
      c.T_from_to.t.z(), Degrees(LogSo3(c.T_from_to.q).norm()));
}

// One paragraph per step, up to the one that refused.
std::string MeasuredText(const LoopVerificationReport& report) {
  std::string text;
  std::string_view step;
  for (const Measurement& m : report.measured) {
    text += fmt::format("{:31}  {:26}  {:>8.4g}  at {} {:.4g}\n", m.step == step ? "" : m.step,
                        m.option, m.value, m.at_least ? "least" : "most ", m.limit);
    step = m.step;
  }
  return report.refused_by.empty() ? text
                                   : text + fmt::format("refused by: {}\n", report.refused_by);
}

}  // namespace

std::string ListResults(const std::string& log, LogReadings* readings) {
  std::string text;
  const auto list = [&text](const LogEvent& event) {
    if (event.channel != channels::kConstraint) {
      return;
    }
    if (const auto constraint = ParseMessage<constraint_t>(event.data).value) {
      text += fmt::format("{:>20}  {} in {}  {}\n", constraint->Id(), ToString(constraint->to),
                          ToString(constraint->from),
                          constraint->accepted ? "accepted" : constraint->reason);
    }
  };
  ReadLog(log, list, readings);
  return text.empty() ? fmt::format("{}: no CONSTRAINT in this log\n", log) : text;
}

Explanation Explain(const std::string& log, int64_t constraint_id, LogReadings* readings) {
  Explanation explanation;
  explanation.said = FindResult(log, constraint_id, readings);
  explanation.candidate = FindCandidate(log, explanation.said, readings);
  const std::unique_ptr<LoopVerifier> verifier =
      VerifierOf(explanation.said.kind, ReadLoggedOptions({log}, readings), &explanation);
  bool from = false, to = false;
  const auto add = [&](const LogEvent& event) {
    auto keyframe = event.channel.starts_with(channels::kKeyframePrefix)
                        ? ParseMessage<KeyframeMessage>(event.data).value
                        : std::nullopt;
    if (!keyframe) {
      return;
    }
    if (keyframe->id == explanation.said.from) {
      explanation.from = *keyframe;
      from = true;
    }
    if (keyframe->id == explanation.said.to) {
      explanation.to = *keyframe;
      to = true;
    }
    verifier->Add(std::move(*keyframe));
  };
  ReadLog(log, add, readings);
  if (!from || !to) {
    throw std::runtime_error(
        fmt::format("{}: keyframe {} is not in this log", log,
                    ToString(from ? explanation.said.to : explanation.said.from)));
  }
  explanation.again =
      verifier->Verify(explanation.said.to, explanation.candidate, &explanation.report);
  return explanation;
}

void CheckConstraintId(const std::vector<std::string>& logs, int64_t constraint_id,
                       LogReadings* readings) {
  std::set<KeyframeId> keyframes;
  const auto add = [&keyframes](const LogEvent& event) {
    KeyframeMessage message{};
    if (event.channel.starts_with(channels::kKeyframePrefix) &&
        DecodeMessage(event.data, &message)) {
      if (const auto id = Parse(message.id).value) {
        keyframes.insert(*id);
      }
    }
  };
  for (const std::string& log : logs) {
    ReadLog(log, add, readings);
  }
  for (const KeyframeId& from : keyframes) {
    for (const KeyframeId& to : keyframes) {
      if (ConstraintId(from, to, PlaceKind::kInter) == constraint_id ||
          ConstraintId(from, to, PlaceKind::kTag) == constraint_id ||
          (from.map == to.map && ConstraintId(from, to, PlaceKind::kIntra) == constraint_id)) {
        return;
      }
    }
  }
  throw std::runtime_error(fmt::format(
      "--explain {}: no match of two keyframes of {} has this id; pangea-log explain LOG "
      "lists the constraints of a log",
      constraint_id, fmt::join(logs, ", ")));
}

std::string ToText(const Explanation& e) {
  const auto result = [](const Constraint& c) { return c.accepted ? "accepted" : c.reason; };
  std::string text = fmt::format(
      "{} (query) in {} (match), {}\nresult in the log: {}\nmade again:        {}\n\n",
      ToString(e.said.to), ToString(e.said.from),
      e.said.from.map == e.said.to.map ? "one map" : "two maps", result(e.said), result(e.again));
  for (const std::string& note : e.options_notes) {
    text += note + "\n";
  }
  text += fmt::format(
      "candidate    {} corners matched, score {:.4f}\n"
      "PnP          {}\n",
      e.candidate.corner_matches.size(), e.candidate.score, CountOf(e.report.first));
  text += e.report.found.empty() ? "window BA    not reached\n" : WindowBaText(e);
  return text + "\n" + MeasuredText(e.report);
}

}  // namespace pangea
