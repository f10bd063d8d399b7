#pragma once

// An agent's pre-shared key in a text file (mode 0600), made by `pangea-agent-handler keygen`. The
// agent has its own key file, the server a folder with those of all agents. The server's copy also
// says what the agent may do with anchors: `anchors: read` (only see them), `own` (edit those that
// it made; also the default) or `write` (edit all).

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/anchor.h"
#include "link/seal.h"

namespace pangea {

struct AgentKey {
  int32_t agent_id = 0;
  SecretKey key;
  AnchorRight anchors = AnchorRight::kEditOwn;
};

// The right for "read", "own" or "write"; nothing for another word.
std::optional<AnchorRight> AnchorRightOf(std::string_view word);
std::string WordOf(AnchorRight right);

// The key as 64 hexadecimal digits, as in the file.
std::string ToHex(const SecretKey& key);

// "agent_4.key"
std::string KeyFileName(int32_t agent_id);

// Writes a file with a new random key, atomically. Throws std::runtime_error if the file exists or
// cannot be written.
void MakeKeyFile(const std::filesystem::path& file, int32_t agent_id,
                 AnchorRight anchors = AnchorRight::kEditOwn);

// Throws std::runtime_error if the file is missing, readable by others or malformed. The message
// names the file and says what to do.
AgentKey ReadKeyFile(const std::filesystem::path& file);
// The same; also throws if the key is another agent's.
SecretKey ReadKeyFileOf(const std::filesystem::path& file, int32_t agent_id);

// The *.key files of a folder. It can be checked for changes, so that agents are admitted and
// removed while the server runs.
class KeyFolder {
 public:
  static constexpr size_t kMaxKeys = 1000;  // a server accepts no more

  explicit KeyFolder(std::filesystem::path folder) : folder_(std::move(folder)) {}

  // Returns the keys by agent. Throws std::runtime_error if there is no such folder. A file that
  // cannot be used may be half written: its key from the last Read, if any, stays valid. If an
  // agent has two keys, the one that the last Read returned stays valid.
  std::map<int32_t, AgentKey> Read();
  // For people: each file that the last Read could not use, also a second key of an agent, and what
  // to do.
  const std::vector<std::string>& unusable() const { return unusable_; }
  // Whether files were added, removed or changed since the last Read, or some were not usable.
  bool Changed() const;
  // Whether the file from which the last Read took the agent's key no longer exists.
  bool IsGone(int32_t agent_id) const;

 private:
  using Stamps = std::map<std::filesystem::path, std::filesystem::file_time_type>;
  Stamps Look() const;
  // The key that the last Read took from this file; null if none.
  const AgentKey* LastOf(const std::filesystem::path& file) const;
  std::optional<AgentKey> ReadOrLast(const std::filesystem::path& file);
  int Rank(const std::filesystem::path& file, int32_t agent_id) const;

  std::filesystem::path folder_;
  Stamps seen_;
  std::map<int32_t, std::filesystem::path> files_;
  std::map<int32_t, AgentKey> keys_;  // the result of the last Read
  std::vector<std::string> unusable_;
};

}  // namespace pangea
