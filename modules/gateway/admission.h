#pragma once

// Who may join a site with a code, and who joined, in the site's folder:
//
//   gateway/invites/<hash>.json   an invite, named by the SHA-256 of its code (the first 128 bits);
//                                 the code itself is not stored
//   gateway/agents/<id>.json      an agent that joined: its name and when; stays after it is
//                                 revoked, so that its id, which is on its maps and anchors, is not
//                                 used again
//   keys/agent_<id>.key           its key, which the agent_handler reads; an agent without a key is
//                                 revoked
//
// All files are written atomically, so several programs may work here at once, and may be killed. A
// code is used up by removing its invite, which the file system lets only one program do.

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

// Makes the folder gateway/ and its folders above, readable only by the owner. Throws
// std::runtime_error when it cannot.
void MakeGatewayFolders(const site::Site& site);

class Admission {
 public:
  static constexpr int32_t kFirstAgent = 1001;  // lower ids are for keys made by hand
  static constexpr size_t kMaxInvites = 1000;

  explicit Admission(const site::Site& site);

  // Makes an invite and returns its code. Throws std::runtime_error if there are too many invites
  // or the disk fails.
  std::string Make(const Invite& invite);
  // Uses up the code and returns the key of a new agent. The key is written to the disk before the
  // code is used up; after a crash in between, nobody has got that key.
  JoinResult Join(const JoinRequest& request, int64_t now_s);
  // Removes the agent's key. Throws std::runtime_error if it has none.
  void Revoke(int32_t agent_id);

  // The invites that are still open; expired ones are removed. Files that are no invites are
  // ignored.
  std::vector<Invite> Invites(int64_t now_s);
  std::map<int32_t, JoinedAgent> Agents() const;

 private:
  std::filesystem::path InviteFile(const std::string& plain_code) const;
  std::filesystem::path AgentFile(int32_t agent_id) const;
  std::filesystem::path KeyFile(int32_t agent_id) const;
  // Makes a new agent with a key and returns its id.
  int32_t MakeAgent(const std::string& name, AnchorRight anchors, int64_t now_s);
  bool HasRoom() const;

  const std::filesystem::path invites_, agents_, keys_;
};

}  // namespace pangea
