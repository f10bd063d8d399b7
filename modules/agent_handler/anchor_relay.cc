#include "agent_handler/anchor_relay.h"

#include <fmt/format.h>

#include <utility>

#include "messages/channels.h"
#include "messages/encoding.h"

namespace pangea {
namespace {

constexpr char kFull[] = "the journal has as many edits of anchors as it takes: no more";

bool Allows(AnchorRight right, int32_t agent_id, const AnchorEdit& edit) {
  return right == AnchorRight::kEditAll ||
         (right == AnchorRight::kEditOwn && edit.anchor.agent_id == agent_id);
}

}  // namespace

AnchorRelay::AnchorRelay(Node& node, Archive& archive) : node_(node), archive_(archive) {
  node_.Subscribe<anchor_t>(
      std::string(channels::kAllAnchors),
      [this](const std::string& channel, const anchor_t& message) { OnAnchor(channel, message); });
  node_.Listen<anchor_edit_t>(channels::AnchorRequest(0), [this](AnchorEdit edit) {
    edit.agent_id = 0;
    edit.right = AnchorRight::kEditAll;
    if (const std::string refusal = RefusalOfNewEdit(edit); !refusal.empty()) {
      return node_.Refuse(refusal);
    }
    if (from_tools_.size() >= kMaxFromTools) {
      return node_.Refuse("too many edits of anchors wait for the disk");
    }
    from_tools_.push_back(std::move(edit));
  });
}

void AnchorRelay::SetRights(const std::map<int32_t, AnchorRight>& rights) {
  std::erase_if(agents_, [&](const auto& item) { return !rights.contains(item.first); });
  for (const auto& [agent_id, right] : rights) {
    agents_[agent_id].right = right;
  }
}

void AnchorRelay::OnAnchor(const std::string& channel, const anchor_t& message) {
  const int32_t agent_id = channels::AgentOf(channel, channels::kAnchorPrefix);
  const auto agent = agents_.find(agent_id);
  if (agent == agents_.end()) {
    return node_.Refuse("anchor for an agent without a key");
  }
  const auto state = Parse(message);
  if (!state.value || state.value->map.agent_id != agent_id) {
    return node_.Refuse(state.value ? "anchor in another agent's map" : state.refused);
  }
  if (!agent->second.table.Set(*state.value, EncodeMessage(message))) {
    node_.Count("anchors_left_out");
    node_.Refuse(fmt::format("agent {} has {} anchors: no more are sent to it", agent_id,
                             AnchorTable::kMaxAnchors));
  }
}

std::string AnchorRelay::OnPacket(int32_t agent_id, const LinkPacket& packet) {
  Agent& agent = agents_.at(agent_id);
  if (packet.kind == LinkKind::kAnchorsReceived) {
    const auto numbers = ParseAnchorsReceived(packet.body);
    if (numbers.value) {
      agent.table.OnReceived(*numbers.value);
    }
    return numbers.refused;
  }
  auto edit = ParseAnchorEdit(agent_id, packet.body);
  if (edit.value) {
    OnEdit(agent_id, &agent, *std::move(edit.value));
  }
  return edit.refused;
}

void AnchorRelay::OnEdit(int32_t agent_id, Agent* agent, AnchorEdit edit) {
  edit.right = agent->right;
  const std::string refusal =
      Allows(agent->right, agent_id, edit)
          ? RefusalOfNewEdit(edit)
          : fmt::format("agent {}'s key does not allow its edit of an anchor", agent_id);
  if (!refusal.empty()) {
    node_.Count("anchor_edits_refused");
    node_.Refuse(refusal);
    return Answer(agent, edit, false);
  }
  switch (archive_.Append(edit)) {
    case AnchorEdits::Taken::kJournalled:
      return Answer(agent, edit, true);
    case AnchorEdits::Taken::kFull:
      node_.Refuse(kFull);
      return Answer(agent, edit, false);
    case AnchorEdits::Taken::kQueued:
    case AnchorEdits::Taken::kBusy:
      return;
  }
}

// If there is no room for the answer, it is given when the agent sends the edit again.
void AnchorRelay::Answer(Agent* agent, const AnchorEdit& edit, bool journalled) {
  if (agent->answers.size() < kMaxAnchorEditAnswers) {
    agent->answers.push_back({edit.anchor, edit.revision, journalled});
  }
}

void AnchorRelay::OnNewSession(int32_t agent_id) {
  Agent& agent = agents_.at(agent_id);
  agent.table.OnNewSession();
  agent.answers.clear();
}

void AnchorRelay::OnJournalled(const std::vector<AnchorEdit>& edits) {
  for (const AnchorEdit& edit : edits) {
    node_.Count("anchor_edits");
    const auto agent = agents_.find(edit.agent_id);
    if (agent != agents_.end()) {
      Answer(&agent->second, edit, true);
    }
  }
}

bool AnchorRelay::TakeFromTool(const AnchorEdit& edit) {
  const AnchorEdits::Taken taken = archive_.Append(edit);
  if (taken == AnchorEdits::Taken::kFull) {
    node_.Refuse(kFull);
  }
  return taken != AnchorEdits::Taken::kBusy;
}

void AnchorRelay::Poll() {
  while (!from_tools_.empty() && TakeFromTool(from_tools_.front())) {
    from_tools_.pop_front();
  }
}

void AnchorRelay::SendDue(int32_t agent_id, int64_t now_us, const Send& send) {
  Agent& agent = agents_.at(agent_id);
  if (!agent.answers.empty()) {
    send(LinkKind::kAnchorEditAnswers, EncodeAnchorEditAnswers(std::exchange(agent.answers, {})));
  }
  while (const auto body = agent.table.Next(now_us)) {
    agent.table.Charge(send(LinkKind::kAnchor, *body));
    node_.Count("anchors_sent");
  }
}

void AnchorRelay::SetCounters() {
  int64_t unconfirmed = 0;
  for (const auto& [agent_id, agent] : agents_) {
    unconfirmed += static_cast<int64_t>(agent.table.unconfirmed());
  }
  node_.Set("anchors_unconfirmed", unconfirmed);
}

}  // namespace pangea
