#include "phone/agent/phone_agent.h"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "messages/anchor_messages.h"
#include "messages/channels.h"
#include "messages/encoding.h"
#include "messages/keyframe_message.h"
#include "pangea/pose_t.hpp"

namespace pangea::phone {
namespace {

constexpr int64_t kTickInterval_us = 100'000;

struct KeyframeHead {
  KeyframeId id;
  std::optional<CameraModel> camera;
};

std::optional<KeyframeHead> HeadOf(Bytes keyframe) {
  KeyframeMessage message{};
  if (!DecodeMessage(keyframe, &message)) {
    return std::nullopt;
  }
  const std::optional<KeyframeId> id = Parse(message.id).value;
  return id ? std::optional(KeyframeHead{*id, Parse(message.camera).value}) : std::nullopt;
}

}  // namespace

PhoneAgent::PhoneAgent(const AgentConfig& config)
    : agent_id_(config.agent_id),
      image_size_(config.camera.width, config.camera.height),
      node_(agent_bus_, fmt::format("phone_{}", config.agent_id)),
      odometry_(MakeOdometry(agent_bus_, config)),
      now_us_(config.opened_utime) {
  if (config.key) {
    uplink_.emplace(agent_bus_, link_bus_, agent_id_, *config.key, config.uplink, nullptr, &edits_);
  }
  Listen();
}

void PhoneAgent::Listen() {
  agent_bus_.Subscribe(channels::Keyframe(agent_id_),
                       [this](const std::string&, Bytes data) { OnKeyframe(data); });
  link_bus_.Subscribe(channels::LinkUp(agent_id_), [this](const std::string&, Bytes data) {
    events_.link_up.emplace_back(data.begin(), data.end());
  });
  node_.Subscribe<pose_t>(channels::Pose(agent_id_),
                          [this](const std::string&, const pose_t& message) { OnPose(message); });
  node_.Listen<correction_t>(channels::Correction(agent_id_), [this](const Correction& correction) {
    // Corrections of maps of earlier runs come too.
    if (correction.map == map_ &&
        (!correction_ || correction_->map != map_ || correction_->revision < correction.revision)) {
      correction_ = correction;
    }
  });
  node_.Listen<have_t>(channels::kHave, [this](const Have& have) { Release(have); });
  node_.Listen<anchor_t>(channels::Anchor(agent_id_),
                         [this](const AnchorState& state) { anchors_.Take(state); });
  node_.Listen<shown_anchors_t>(
      channels::ShownAnchors(agent_id_),
      [this](const ShownAnchors& shown) { events_.anchors = anchors_.Draw(shown); });
  node_.Listen<others_t>(channels::Others(agent_id_),
                         [this](const Others& others) { events_.others = others; });
  node_.Subscribe<status_t>(
      channels::Status(odometry_->node().name()),
      [this](const std::string&, const status_t& status) { events_.vio_status = status; });
  node_.Subscribe<status_t>(
      channels::Status(fmt::format("uplink_{}", agent_id_)),
      [this](const std::string&, const status_t& status) { events_.uplink_status = status; });
}

void PhoneAgent::AddImage(int64_t utime, const cv::Mat& image,
                          const std::optional<Rigid3>& T_odom_body) {
  if (image.type() != CV_8U || image.size() != image_size_) {
    RefuseImage(utime, image.size());
  } else {
    odometry_->AddImage(utime, image, T_odom_body);
  }
  agent_bus_.Drain();
}

// A pose with the reason, because the page shows nothing else of the agent to the visitor.
void PhoneAgent::RefuseImage(int64_t utime, const cv::Size& size) {
  const std::string why = fmt::format("{}x{} pixels, but the calibration is of {}x{}", size.width,
                                      size.height, image_size_.width, image_size_.height);
  odometry_->node().Refuse("image: " + why);
  PhonePose pose;
  pose.utime = utime;
  pose.state = pose_t::STATE_INITIALISING;
  pose.reason = why;
  pose.map = map_;
  events_.pose = std::move(pose);
}

void PhoneAgent::OnLinkDown(Bytes packet) {
  link_bus_.Publish(channels::LinkDown(agent_id_), packet);
  link_bus_.Drain();
}

// The keyframe is published as if the odometry had just finished it, so the uplink takes it.
void PhoneAgent::Restore(const std::string& id, Bytes bytes) {
  const std::optional<KeyframeHead> keyframe = HeadOf(bytes);
  if (!keyframe) {
    RestoreEdit(id, bytes);
  } else if (keyframe->id.map.agent_id == agent_id_ && uplink_) {
    spooled_.insert(keyframe->id);
    agent_bus_.Publish(channels::Keyframe(agent_id_), bytes);
    agent_bus_.Drain();
  }
}

// The edit is published as if the app had just made it, so the uplink takes it.
void PhoneAgent::RestoreEdit(const std::string& id, Bytes bytes) {
  anchor_edit_t message{};
  const bool decodes = DecodeMessage(bytes, &message);
  const std::optional<AnchorEdit> edit = decodes ? Parse(message).value : std::nullopt;
  if (!edit || !RefusalOfNewEdit(*edit).empty()) {
    events_.spool.push_back({id, {}});
  } else if (edit->agent_id == agent_id_ && uplink_) {
    node_.Publish(channels::AnchorRequest(agent_id_), message);
    agent_bus_.Drain();
  }
}

void PhoneAgent::OnKeyframe(Bytes data) {
  const std::optional<KeyframeHead> keyframe = HeadOf(data);
  const std::vector<uint8_t> bytes(data.begin(), data.end());
  if (!keyframe || spooled_.contains(keyframe->id)) {
    return;
  }
  if (keyframe->camera) {
    events_.camera = keyframe->camera;
  }
  if (uplink_) {
    spooled_.insert(keyframe->id);
    events_.spool.push_back({ToString(keyframe->id), bytes});
  }
  events_.keyframes.push_back(bytes);
}

void PhoneAgent::Release(const Have& have) {
  for (const auto& [map, highest_seq] : have.highest_seq) {
    auto it = spooled_.lower_bound({map, 0});
    while (it != spooled_.end() && it->map == map && it->seq <= highest_seq) {
      events_.spool.push_back({ToString(*it), {}});
      it = spooled_.erase(it);
    }
  }
}

void PhoneAgent::OnPose(const pose_t& message) {
  PhonePose pose;
  pose.utime = message.utime;
  pose.state = message.state;
  pose.reason = message.reason;
  pose.map = map_ = Parse(message.map).value.value_or(MapId{});
  pose.T_odom_body = Parse(message.T_odom_body).value.value_or(Rigid3{});
  pose.num_tracked = message.num_tracked;
  if (correction_ && correction_->map == pose.map && message.group_revision > 0) {
    pose.in_group = {correction_->group,
                     Parse(message.T_map_body).value.value_or(pose.T_odom_body)};
  }
  if (pose.state == pose_t::STATE_TRACKING) {
    NoteTracked(pose.utime, pose.map);
  }
  events_.pose = std::move(pose);
}

void PhoneAgent::NoteTracked(int64_t utime, const MapId& map) {
  if (tracked_.empty() || tracked_.back().map != map) {
    tracked_.push_back({map, utime, utime});
  }
  tracked_.back().last_utime = utime;
  if (tracked_.size() > kMaxTrackedMaps) {
    tracked_.pop_front();
  }
}

// The map of a tracked image. It may have ended since: a person takes seconds to name an anchor.
std::optional<MapId> PhoneAgent::MapAt(int64_t utime) const {
  const auto tracks = [&](const TrackedMap& tracked) {
    return tracked.first_utime <= utime && utime <= tracked.last_utime;
  };
  const auto found = std::find_if(tracked_.rbegin(), tracked_.rend(), tracks);
  return found == tracked_.rend() ? std::nullopt : std::optional(found->map);
}

AnchorId PhoneAgent::PlaceAnchor(const NewAnchor& anchor) {
  if (!uplink_) {
    throw std::runtime_error("only an agent that has joined a server can place anchors");
  }
  const std::optional<MapId> map = MapAt(anchor.utime);
  if (!map) {
    throw std::runtime_error("the odometry did not track this image: an anchor has no place in it");
  }
  last_created_utime_ = std::max(now_us_, last_created_utime_ + 1);
  AnchorEdit edit;
  edit.anchor = {agent_id_, last_created_utime_};
  edit.agent_id = agent_id_;
  edit.name = anchor.name;
  edit.payload = anchor.payload;
  edit.map = *map;
  edit.utime = anchor.utime;
  edit.placement = anchor.pixel ? AnchorEdit::Placement::kPixel : AnchorEdit::Placement::kBody;
  edit.pixel = anchor.pixel.value_or(Eigen::Vector2d::Zero());
  edit.T_ref_anchor = anchor.T_body_anchor;
  if (const std::string refusal = RefusalOfNewEdit(edit); !refusal.empty()) {
    throw std::runtime_error(refusal);
  }
  const anchor_edit_t message = ToMessage(edit);
  if (const auto parsed = Parse(message); !parsed.value) {
    throw std::runtime_error(parsed.refused);
  }
  node_.Publish(channels::AnchorRequest(agent_id_), message);
  agent_bus_.Drain();
  return edit.anchor;
}

void PhoneAgent::RemoveAnchor(const AnchorId& id) {
  const AnchorState* const state = anchors_.Find(id);
  if (state == nullptr) {
    return;
  }
  AnchorEdit edit;
  edit.anchor = id;
  edit.revision = state->revision + 1;
  edit.agent_id = agent_id_;
  edit.deleted = true;
  edit.name = state->name;
  edit.payload = state->payload;
  node_.Publish(channels::AnchorRequest(agent_id_), ToMessage(edit));
  agent_bus_.Drain();
}

void PhoneAgent::Poll(int64_t now_us) {
  now_us_ = now_us;
  agent_bus_.Drain();
  if (uplink_) {
    uplink_->Poll(now_us);
  }
  if (now_us >= next_tick_us_) {
    next_tick_us_ = now_us + kTickInterval_us;
    odometry_->Tick(now_us);
    if (uplink_) {
      uplink_->Tick(now_us);
    }
  }
  agent_bus_.Drain();
  link_bus_.Drain();
}

void PhoneAgent::StartAnew() {
  odometry_->StartAnew();
  agent_bus_.Drain();
}

void PhoneAgent::Flush() {
  odometry_->Flush();
  agent_bus_.Drain();
}

PhoneEvents PhoneAgent::Take() { return std::exchange(events_, {}); }

}  // namespace pangea::phone
