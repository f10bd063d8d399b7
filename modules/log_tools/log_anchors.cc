#include "log_tools/log_anchors.h"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

#include "anchors/anchor_registry.h"
#include "log_file/log_event.h"
#include "log_file/log_reader.h"
#include "messages/anchor_messages.h"
#include "messages/channels.h"
#include "messages/encoding.h"
#include "server_options/server_options.h"

namespace pangea {
namespace {

using nlohmann::ordered_json;

class Collector {
 public:
  explicit Collector(size_t max_anchors) : registry_(max_anchors) {}

  void Take(const LogEvent& event) {
    if (event.channel == channels::kAnchorEdit) {
      ++logged_.num_edits;
      Take<anchor_edit_t>(event.data, [this](const AnchorEdit& edit) {
        logged_.num_refused += registry_.Take(edit).empty() ? 0 : 1;
      });
    } else if (event.channel == channels::kAnchor) {
      ++logged_.num_states;
      Take<anchor_t>(event.data,
                     [this](AnchorState& state) { states_[state.anchor] = std::move(state); });
    }
  }

  LoggedAnchors Finish() {
    for (const auto& [id, entry] : registry_.entries()) {
      logged_.anchors[id] = {entry.revision, entry.edited_by, entry.deleted, entry.name,
                             entry.payload,  std::nullopt,    std::nullopt};
      if (!entry.places.empty()) {
        logged_.anchors[id].place = entry.places.rbegin()->second;
      }
    }
    for (auto& [id, state] : states_) {
      LoggedAnchor& anchor = logged_.anchors[id];
      anchor.deleted |= state.gone;
      // A log may lack edits that the anchors process received.
      if (state.revision > anchor.revision) {
        anchor.revision = state.revision;
        anchor.edited_by = state.edited_by;
        anchor.name = state.name;
        anchor.payload = state.payload;
      }
      anchor.state = std::move(state);
    }
    return std::move(logged_);
  }

 private:
  template <typename Message, typename Handler>
  void Take(Bytes data, const Handler& handler) {
    auto parsed = ParseMessage<Message>(data);
    if (parsed.value) {
      handler(*parsed.value);
    } else {
      ++logged_.num_refused;
    }
  }

  LoggedAnchors logged_;
  AnchorRegistry registry_;
  std::map<AnchorId, AnchorState> states_;
};

std::string StateOf(const LoggedAnchor& anchor) {
  if (anchor.deleted) {
    return "deleted";
  }
  return anchor.state ? "placed" : "edited";
}

std::string MakerOf(const AnchorId& id) {
  return id.agent_id == 0 ? "server" : fmt::format("agent {}", id.agent_id);
}

ordered_json PoseJson(const Rigid3& T) {
  return {{"t_m", {T.t.x(), T.t.y(), T.t.z()}}, {"q_wxyz", {T.q.w(), T.q.x(), T.q.y(), T.q.z()}}};
}

ordered_json CovarianceJson(const Matrix6d& covariance) {
  ordered_json rows = ordered_json::array();
  for (int row = 0; row < 6; ++row) {
    for (int column = 0; column < 6; ++column) {
      rows.push_back(covariance(row, column));
    }
  }
  return rows;
}

const char* NameOf(AnchorEdit::Placement placement) {
  switch (placement) {
    case AnchorEdit::Placement::kSame:
      return "same";
    case AnchorEdit::Placement::kKeyframe:
      return "keyframe";
    case AnchorEdit::Placement::kBody:
      return "body";
    case AnchorEdit::Placement::kPixel:
      return "pixel";
  }
  return "";
}

ordered_json PlaceJson(const AnchorEdit& place) {
  ordered_json json = {{"placement", NameOf(place.placement)},
                       {"revision", place.revision},
                       {"edited_by", place.agent_id},
                       {"seq", place.seq},
                       {"map", ToString(place.map)},
                       {"keyframe_seq", place.keyframe_seq},
                       {"utime", place.utime},
                       {"T_ref_anchor", PoseJson(place.T_ref_anchor)},
                       {"pixel", {place.pixel.x(), place.pixel.y()}}};
  if (place.T_odom_body) {
    json["T_odom_body"] = PoseJson(*place.T_odom_body);
  }
  if (place.covariance) {
    json["covariance"] = CovarianceJson(*place.covariance);
  }
  return json;
}

ordered_json AnchorJson(const AnchorId& id, const LoggedAnchor& anchor) {
  ordered_json json = {{"id", ToString(id)},
                       {"agent_id", id.agent_id},
                       {"created_utime", id.created_utime},
                       {"name", anchor.name},
                       {"payload", anchor.payload},
                       {"revision", anchor.revision},
                       {"edited_by", anchor.edited_by},
                       {"state", StateOf(anchor)}};
  if (anchor.state) {
    const AnchorState& state = *anchor.state;
    json["map"] = ToString(state.map);
    json["group"] = ToString(state.group);
    json["group_revision"] = state.group_revision;
    json["T_map_anchor"] = PoseJson(state.T_odom_anchor);
    json["covariance"] = CovarianceJson(state.covariance);
    json["sigma_m"] = RmsPositionSigma(state);
  }
  if (anchor.place) {
    json["edit"] = PlaceJson(*anchor.place);
  }
  return json;
}

std::string Row(const AnchorId& id, const LoggedAnchor& anchor) {
  std::string place = fmt::format("{:<24} {:>24} {:>8}", "", "", "");
  if (anchor.state && !anchor.deleted) {
    const Eigen::Vector3d& t = anchor.state->T_odom_anchor.t;
    place = fmt::format("{:<24} {:>24} {:>8.3f}", ToString(anchor.state->group),
                        fmt::format("{:.3f} {:.3f} {:.3f}", t.x(), t.y(), t.z()),
                        RmsPositionSigma(*anchor.state));
  }
  return fmt::format("{:<24} {:<11} {:>8} {:<8} {} {:>9}  {}\n", ToString(id), MakerOf(id),
                     anchor.revision, StateOf(anchor), place, anchor.payload.size(), anchor.name);
}

}  // namespace

LoggedAnchors ReadAnchors(const std::string& log, LogReadings* readings) {
  const AnchorsOptions options = ReadLoggedOptions({log}, readings).options.anchors;
  Collector collector(static_cast<size_t>(options.max_anchors));
  ReadLog(
      log, [&collector](const LogEvent& event) { collector.Take(event); }, readings);
  return collector.Finish();
}

double RmsPositionSigma(const AnchorState& state) {
  return std::sqrt(state.covariance.topLeftCorner<3, 3>().trace() / 3);
}

std::string ToText(const LoggedAnchors& logged, const std::string& log) {
  if (logged.num_edits + logged.num_states == 0) {
    return fmt::format("{}: no anchors\n", log);
  }
  std::string text;
  if (logged.edits_only()) {
    text += fmt::format(
        "{}: has edits only, not where they put anchors: pangea-session replay {} --out DIR, then "
        "pangea-log anchors DIR/session.lcm\n",
        log, log);
  }
  if (logged.num_refused > 0) {
    text += fmt::format("{}: {} messages refused\n", log, logged.num_refused);
  }
  text +=
      fmt::format("{:<24} {:<11} {:>8} {:<8} {:<24} {:>24} {:>8} {:>9}  {}\n", "anchor", "made by",
                  "revision", "state", "group", "x y z m", "sigma m", "payload B", "name");
  for (const auto& [id, anchor] : logged.anchors) {
    text += Row(id, anchor);
  }
  return text;
}

std::string ToJson(const LoggedAnchors& logged) {
  ordered_json anchors = ordered_json::array();
  for (const auto& [id, anchor] : logged.anchors) {
    anchors.push_back(AnchorJson(id, anchor));
  }
  // A payload may be invalid UTF-8.
  return ordered_json{{"anchors", std::move(anchors)}}.dump(
             1, ' ', false, ordered_json::error_handler_t::replace) +
         "\n";
}

}  // namespace pangea
