#pragma once

// An agent's pre-shared key as a file: text, mode 0600, made by `pangea-agent-handler keygen`. The
// agent has one, the server a folder of them. The server's copy also says what its agent may do
// with anchors, `anchors: read | own | write`: see them, edit those it made (also without the
// line), edit all.

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

// "read", "own" or "write"; nothing of another word.
std::optional<AnchorRight> AnchorRightOf(std::string_view word);
std::string WordOf(AnchorRight right);

// 64 hexadecimal digits, as in the file.
std::string ToHex(const SecretKey& key);

// "agent_4.key"
std::string KeyFileName(int32_t agent_id);

// A new random key; the file is there whole or not at all. Throws std::runtime_error if it exists
// or cannot be written.
void MakeKeyFile(const std::filesystem::path& file, int32_t agent_id,
                 AnchorRight anchors = AnchorRight::kEditOwn);

// Throws std::runtime_error that names the file and the mend: missing, readable by others,
// malformed.
AgentKey ReadKeyFile(const std::filesystem::path& file);
// ... or another agent's.
SecretKey ReadKeyFileOf(const std::filesystem::path& file, int32_t agent_id);

// The *.key files of a folder. Looked at again, it says whether anything has changed, so that
// agents can be let in and shut out while the server runs.
class KeyFolder {
 public:
  static constexpr size_t kMaxKeys = 1000;  // that a server takes

  explicit KeyFolder(std::filesystem::path folder) : folder_(std::move(folder)) {}

  // Throws std::runtime_error: no such folder. A file that cannot be used lets nobody in, and its
  // agent not out: it may be half written. Of two keys of an agent the one that it has counts.
  std::map<int32_t, AgentKey> Read();
  // For people: each file that the last Read could not use, a second key of an agent too, and the
  // mend.
  const std::vector<std::string>& unusable() const { return unusable_; }
  // Whether files have come, gone or changed since the last Read, or wait to be mended.
  bool Changed() const;
  // Whether the file is gone that the last Read had the agent's key from.
  bool IsGone(int32_t agent_id) const;

 private:
  using Stamps = std::map<std::filesystem::path, std::filesystem::file_time_type>;
  Stamps Look() const;
  // Null where the last Read had none from this file.
  const AgentKey* LastOf(const std::filesystem::path& file) const;
  std::optional<AgentKey> ReadOrLast(const std::filesystem::path& file);
  int Rank(const std::filesystem::path& file, int32_t agent_id) const;

  std::filesystem::path folder_;
  Stamps seen_;
  std::map<int32_t, std::filesystem::path> files_;
  std::map<int32_t, AgentKey> keys_;  // as last read
  std::vector<std::string> unusable_;
};

}  // namespace pangea
