#pragma once

// Who may join a site by a code, and who did, in the site's folder:
//
//   gateway/invites/<hash>.json   an invite; SHA-256 of its code is its name, the code is nowhere
//   gateway/agents/<id>.json      an agent that joined: its name and when; stays when it is
//   revoked,
//                                 so that nobody else gets its id, which is on its maps and anchors
//   keys/agent_<id>.key           its key, which the agent_handler takes up; revoked is who has
//   none
//
// Each is a file of its own that is there whole or not at all, so several programs may work here at
// once and may be killed. A code is used up by removing its invite: the file system lets one do
// that.

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/anchor.h"
#include "gateway/gateway.h"
#include "site/site.h"

namespace pangea {

struct Invite {
  std::string name;  // for the visitor; may be empty
  AnchorRight anchors = AnchorRight::kEditOwn;
  int64_t expires_s = 0;  // since 1970
};

struct JoinedAgent {
  int32_t agent_id = 0;
  std::string name;
  int64_t joined_s = 0;  // since 1970
};

// gateway/ and what is above in it; nobody else looks into it. Throws std::runtime_error when it
// cannot.
void MakeGatewayFolders(const site::Site& site);

class Admission {
 public:
  static constexpr int32_t kFirstAgent = 1001;  // below are those whose keys somebody made
  static constexpr size_t kMaxInvites = 1000;

  explicit Admission(const site::Site& site);

  // The code. Throws std::runtime_error: there are too many, the disk refuses.
  std::string Make(const Invite& invite);
  // Uses up the code for a key of a new agent: the key is on the disk before, and nobody gets it
  // after a crash in between.
  JoinResult Join(const JoinRequest& request, int64_t now_s);
  // Takes the agent's key away. Throws std::runtime_error if it has none.
  void Revoke(int32_t agent_id);

  // Those that are still open; removes those that have expired. A file that is none is left out.
  std::vector<Invite> Invites(int64_t now_s);
  std::map<int32_t, JoinedAgent> Agents() const;

 private:
  std::filesystem::path InviteFile(const std::string& plain_code) const;
  std::filesystem::path AgentFile(int32_t agent_id) const;
  std::filesystem::path KeyFile(int32_t agent_id) const;
  // A new agent with a key.
  int32_t MakeAgent(const std::string& name, AnchorRight anchors, int64_t now_s);
  bool HasRoom() const;

  const std::filesystem::path invites_, agents_, keys_;
};

}  // namespace pangea
