#include "messages/anchor_messages.h"

#include <algorithm>
#include <cmath>

#include "messages/messages_checks.h"

namespace pangea {

using namespace messages_checks;

namespace {

constexpr int kMaxShown = 256;
constexpr int64_t kMaxRevision = 1LL << 60;
constexpr double kMaxPixel = 1e5;

// Whether the text is short enough and on one line. Journals of earlier versions may have other
// control characters: RefusalOfNewEdit.
bool IsName(const std::string& name) {
  return name.size() <= kMaxAnchorName &&
         std::none_of(name.begin(), name.end(),
                      [](unsigned char c) { return c < 0x20 || c == 0x7f; });
}

// A text with a zero byte would be encoded only up to it, as a message that does not decode.
bool IsPayload(const std::string& payload) {
  return payload.size() <= kMaxAnchorPayload && payload.find('\0') == std::string::npos;
}

bool IsUtime(int64_t utime) { return utime >= 0 && utime <= kMaxUtime; }
bool IsRevision(int64_t revision) { return revision >= 0 && revision <= kMaxRevision; }
bool IsAgent(int32_t agent_id) { return agent_id >= 0 && agent_id <= 65535; }

std::optional<Matrix6d> ToCovariance6(const float* values) {
  const Eigen::Matrix<double, 6, 6, Eigen::RowMajor> wide =
      Eigen::Map<const Eigen::Matrix<float, 6, 6, Eigen::RowMajor>>(values).cast<double>();
  return ToCovariance<6>(wide.data());
}

void FromCovariance6(const Matrix6d& covariance, float* values) {
  Eigen::Map<Eigen::Matrix<float, 6, 6, Eigen::RowMajor>>{values} = covariance.cast<float>();
}

bool IsZero(const float* values) {
  return std::all_of(values, values + 36, [](float v) { return v == 0; });
}

bool IsZero(const quaternion_t& q) { return q.w == 0 && q.x == 0 && q.y == 0 && q.z == 0; }

// Parses the fields about the place. Returns why they are refused, or an empty string.
std::string ParsePlace(const anchor_edit_t& m, AnchorEdit* edit) {
  const auto map = Parse(m.map);
  if (!map.value || m.keyframe_seq < 0 || m.keyframe_seq > kMaxSeq || !IsUtime(m.utime)) {
    return "anchor edit: invalid map, keyframe or time";
  }
  // A pixel needs no transform, so an app may leave it as it is in a new message.
  const bool is_needed = m.placement != anchor_edit_t::PLACEMENT_PIXEL;
  const auto T_ref_anchor = is_needed || !IsZero(m.T_ref_anchor.rotation)
                                ? Parse(m.T_ref_anchor)
                                : Parsed<Rigid3>{Rigid3(), ""};
  if (!T_ref_anchor.value) {
    return "anchor edit: T_ref_anchor: " + T_ref_anchor.refused;
  }
  const Eigen::Vector2d pixel(m.pixel[0], m.pixel[1]);
  if (!pixel.allFinite() || pixel.cwiseAbs().maxCoeff() > kMaxPixel) {
    return "anchor edit: pixel out of range";
  }
  if (!IsZero(m.covariance)) {
    edit->covariance = ToCovariance6(m.covariance);
    if (!edit->covariance) {
      return "anchor edit: invalid covariance";
    }
  }
  if (m.has_T_odom_body != 0) {
    edit->T_odom_body = Parse(m.T_odom_body).value;
    if (!edit->T_odom_body) {
      return "anchor edit: invalid pose of the agent";
    }
  }
  edit->map = *map.value;
  edit->keyframe_seq = m.keyframe_seq;
  edit->utime = m.utime;
  edit->T_ref_anchor = *T_ref_anchor.value;
  edit->pixel = pixel;
  return "";
}

}  // namespace

anchor_id_t ToMessage(const AnchorId& id) {
  anchor_id_t m{};
  m.agent_id = id.agent_id;
  m.created_utime = id.created_utime;
  return m;
}

anchor_edit_t ToMessage(const AnchorEdit& edit) {
  anchor_edit_t m{};
  m.anchor = ToMessage(edit.anchor);
  m.revision = edit.revision;
  m.agent_id = edit.agent_id;
  m.may = static_cast<int8_t>(edit.right);
  m.seq = edit.seq;
  m.deleted = static_cast<int8_t>(edit.deleted);
  m.name = edit.name;
  m.payload = edit.payload;
  m.placement = static_cast<int8_t>(edit.placement);
  m.map = ToMessage(edit.map);
  m.keyframe_seq = edit.keyframe_seq;
  m.utime = edit.utime;
  m.T_ref_anchor = ToMessage(edit.T_ref_anchor);
  m.has_T_odom_body = static_cast<int8_t>(edit.T_odom_body.has_value());
  m.T_odom_body = ToMessage(edit.T_odom_body.value_or(Rigid3()));
  Eigen::Vector2f::Map(m.pixel) = edit.pixel.cast<float>();
  if (edit.covariance) {
    FromCovariance6(*edit.covariance, m.covariance);
  }
  return m;
}

anchor_t ToMessage(const AnchorState& state) {
  anchor_t m{};
  m.anchor = ToMessage(state.anchor);
  m.revision = state.revision;
  m.edited_by = state.edited_by;
  m.state = state.gone ? anchor_t::STATE_GONE : anchor_t::STATE_PLACED;
  m.name = state.name;
  m.payload = state.payload;
  m.map = ToMessage(state.map);
  m.group = ToMessage(state.group);
  m.group_revision = state.group_revision;
  m.T_odom_anchor = ToMessage(state.T_odom_anchor);
  FromCovariance6(state.covariance, m.covariance);
  return m;
}

shown_anchors_t ToMessage(const ShownAnchors& shown) {
  shown_anchors_t m{};
  m.utime = shown.utime;
  m.map = ToMessage(shown.map);
  for (const ShownAnchor& anchor : shown.anchors) {
    shown_anchor_t a{};
    a.anchor = ToMessage(anchor.anchor);
    a.revision = anchor.revision;
    a.T_odom_anchor = ToMessage(anchor.T_odom_anchor);
    m.anchors.push_back(a);
  }
  m.num_anchors = static_cast<int16_t>(m.anchors.size());
  return m;
}

Parsed<AnchorId> Parse(const anchor_id_t& m) {
  if (!IsAgent(m.agent_id) || !IsUtime(m.created_utime)) {
    return Refused<AnchorId>("anchor id out of range");
  }
  return {AnchorId{m.agent_id, m.created_utime}, ""};
}

Parsed<AnchorEdit> Parse(const anchor_edit_t& m) {
  const auto id = Parse(m.anchor);
  if (!id.value || !IsAgent(m.agent_id) || m.revision < 1 || !IsRevision(m.revision) ||
      m.seq < -1 || m.may < anchor_edit_t::MAY_UNKNOWN || m.may > anchor_edit_t::MAY_EDIT_ALL) {
    return Refused<AnchorEdit>("anchor edit: invalid id, editor, revision or right");
  }
  if (!IsName(m.name) || !IsPayload(m.payload)) {
    return Refused<AnchorEdit>("anchor edit: name or payload too long, or not printable");
  }
  if (m.placement < anchor_edit_t::PLACEMENT_SAME || m.placement > anchor_edit_t::PLACEMENT_PIXEL) {
    return Refused<AnchorEdit>("anchor edit: unknown placement");
  }
  AnchorEdit edit;
  edit.anchor = *id.value;
  edit.revision = m.revision;
  edit.agent_id = m.agent_id;
  edit.right = static_cast<AnchorRight>(m.may);
  edit.seq = m.seq;
  edit.deleted = m.deleted != 0;
  edit.name = m.name;
  edit.payload = m.payload;
  edit.placement = static_cast<AnchorEdit::Placement>(m.placement);
  if (edit.placement != AnchorEdit::Placement::kSame) {
    if (std::string refused = ParsePlace(m, &edit); !refused.empty()) {
      return Refused<AnchorEdit>(std::move(refused));
    }
  }
  return {std::move(edit), ""};
}

Parsed<AnchorState> Parse(const anchor_t& m) {
  const auto id = Parse(m.anchor);
  const auto map = Parse(m.map);
  const auto group = Parse(m.group);
  const auto T_odom_anchor = Parse(m.T_odom_anchor);
  const auto covariance = ToCovariance6(m.covariance);
  if (!id.value || !map.value || !group.value || !IsAgent(m.edited_by) || m.revision < 1 ||
      !IsRevision(m.revision) || !IsRevision(m.group_revision)) {
    return Refused<AnchorState>("anchor: invalid id, map or revision");
  }
  if (!T_odom_anchor.value || !covariance) {
    return Refused<AnchorState>("anchor: invalid transform or covariance");
  }
  if (!IsName(m.name) || !IsPayload(m.payload) ||
      (m.state != anchor_t::STATE_PLACED && m.state != anchor_t::STATE_GONE)) {
    return Refused<AnchorState>("anchor: invalid name, payload or state");
  }
  return {AnchorState{*id.value, m.revision, m.edited_by, m.state == anchor_t::STATE_GONE, m.name,
                      m.payload, *map.value, *group.value, m.group_revision, *T_odom_anchor.value,
                      *covariance},
          ""};
}

Parsed<ShownAnchors> Parse(const shown_anchors_t& m) {
  const auto map = Parse(m.map);
  if (!map.value || !IsUtime(m.utime) || m.num_anchors < 0 || m.num_anchors > kMaxShown) {
    return Refused<ShownAnchors>("shown anchors: invalid map, time or count");
  }
  ShownAnchors shown{m.utime, *map.value, {}};
  for (const shown_anchor_t& a : m.anchors) {
    const auto id = Parse(a.anchor);
    const auto T_odom_anchor = Parse(a.T_odom_anchor);
    if (!id.value || !T_odom_anchor.value || !IsRevision(a.revision)) {
      return Refused<ShownAnchors>("shown anchors: invalid id, revision or transform");
    }
    shown.anchors.push_back({*id.value, a.revision, *T_odom_anchor.value});
  }
  return {std::move(shown), ""};
}

}  // namespace pangea
