#include "gateway/admission.h"

#include <fmt/format.h>
#include <sodium.h>

#include <array>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "files/text_file.h"
#include "files/whole_file.h"
#include "link/agent_key.h"

namespace pangea {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr int32_t kMaxAgentId = 65535;

// The first 128 bits of the code's SHA-256, in hexadecimal digits.
std::string HashOf(const std::string& plain_code) {
  std::array<uint8_t, crypto_hash_sha256_BYTES> hash;
  crypto_hash_sha256(hash.data(), reinterpret_cast<const uint8_t*>(plain_code.data()),
                     plain_code.size());
  std::string hex;
  for (size_t i = 0; i < hash.size() / 2; ++i) {
    hex += fmt::format("{:02x}", hash[i]);
  }
  return hex;
}

// Nothing if the file does not exist or is not a JSON object.
std::optional<json> ReadJson(const fs::path& file) {
  if (!Exists(file)) {
    return std::nullopt;
  }
  json read = json::parse(ReadTextFile(file), nullptr, false);
  return read.is_object() ? std::optional(std::move(read)) : std::nullopt;
}

std::optional<Invite> ReadInvite(const fs::path& file) {
  try {
    const auto read = ReadJson(file);
    const auto anchors =
        read ? AnchorRightOf(read->at("anchors").get<std::string>()) : std::nullopt;
    return anchors ? std::optional(Invite{read->at("name"), *anchors, read->at("expires_s")})
                   : std::nullopt;
  } catch (const json::exception&) {
    return std::nullopt;
  }
}

std::optional<JoinedAgent> ReadAgent(const fs::path& file) {
  try {
    const auto read = ReadJson(file);
    return read ? std::optional(
                      JoinedAgent{read->at("agent"), read->at("name"), read->at("joined_s")})
                : std::nullopt;
  } catch (const json::exception&) {
    return std::nullopt;
  }
}

std::vector<fs::path> FilesIn(const fs::path& folder, const std::string& extension) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.path().extension() == extension) {
      files.push_back(entry.path());
    }
  }
  return files;
}

JoinResult Refusal(int status, const std::string& error) { return {status, error, 0, ""}; }

}  // namespace

void MakeGatewayFolders(const site::Site& site) {
  fs::create_directories(site.gateway());
  fs::permissions(site.gateway(), fs::perms::owner_all);
  fs::create_directories(site.gateway() / "invites");
  fs::create_directories(site.gateway() / "agents");
}

Admission::Admission(const site::Site& site)
    : invites_(site.gateway() / "invites"), agents_(site.gateway() / "agents"), keys_(site.keys()) {
  MakeGatewayFolders(site);
}

fs::path Admission::InviteFile(const std::string& plain_code) const {
  return invites_ / (HashOf(plain_code) + ".json");
}
fs::path Admission::AgentFile(int32_t agent_id) const {
  return agents_ / fmt::format("{}.json", agent_id);
}
fs::path Admission::KeyFile(int32_t agent_id) const { return keys_ / KeyFileName(agent_id); }

bool Admission::HasRoom() const { return FilesIn(keys_, ".key").size() < KeyFolder::kMaxKeys; }

std::string Admission::Make(const Invite& invite) {
  if (FilesIn(invites_, ".json").size() >= kMaxInvites) {
    throw std::runtime_error(
        fmt::format("{}: there are {} invites: take some out", invites_.string(), kMaxInvites));
  }
  std::string code = NewJoinCode();
  const json written = {
      {"name", invite.name}, {"anchors", WordOf(invite.anchors)}, {"expires_s", invite.expires_s}};
  WriteNewFile(InviteFile(PlainJoinCode(code)), written.dump() + "\n", kOwnerOnly);
  return code;
}

JoinResult Admission::Join(const JoinRequest& request, int64_t now_s) {
  const fs::path file = InviteFile(request.code);
  const auto invite = ReadInvite(file);
  if (!invite || invite->expires_s <= now_s) {
    return Refusal(JoinResult::kWrongCode,
                   "This code is not known, was used already, or is too old. Ask for a new one.");
  }
  if (!HasRoom()) {
    return Refusal(503, "This site has as many agents as it can have. Tell whoever runs it.");
  }
  const int32_t agent_id =
      MakeAgent(request.name.empty() ? invite->name : request.name, invite->anchors, now_s);
  if (!RemoveFile(file)) {
    RemoveFile(KeyFile(agent_id));
    return Refusal(JoinResult::kWrongCode, "This code was used already. Ask for a new one.");
  }
  return {200, "", agent_id, ToHex(ReadKeyFileOf(KeyFile(agent_id), agent_id))};
}

int32_t Admission::MakeAgent(const std::string& name, AnchorRight anchors, int64_t now_s) {
  const auto joined = Agents();
  int32_t agent_id =
      joined.empty() ? kFirstAgent : std::max(kFirstAgent, joined.rbegin()->first + 1);
  for (; agent_id <= kMaxAgentId; ++agent_id) {
    const json written = {{"agent", agent_id}, {"name", name}, {"joined_s", now_s}};
    if (!Exists(KeyFile(agent_id)) &&
        WriteNewFile(AgentFile(agent_id), written.dump() + "\n", kOwnerOnly)) {
      MakeKeyFile(KeyFile(agent_id), agent_id, anchors);
      return agent_id;
    }
  }
  throw std::runtime_error("no agent id is left: begin a new site");
}

void Admission::Revoke(int32_t agent_id) {
  if (!RemoveFile(KeyFile(agent_id))) {
    throw std::runtime_error(
        fmt::format("agent {} has no key {}: pangea-gateway list shows who has", agent_id,
                    KeyFile(agent_id).string()));
  }
}

std::vector<Invite> Admission::Invites(int64_t now_s) {
  std::vector<Invite> open;
  for (const fs::path& file : FilesIn(invites_, ".json")) {
    const auto invite = ReadInvite(file);
    if (invite && invite->expires_s <= now_s) {
      RemoveFile(file);
    } else if (invite) {
      open.push_back(*invite);
    }
  }
  return open;
}

std::map<int32_t, JoinedAgent> Admission::Agents() const {
  std::map<int32_t, JoinedAgent> agents;
  for (const fs::path& file : FilesIn(agents_, ".json")) {
    if (const auto agent = ReadAgent(file)) {
      agents[agent->agent_id] = *agent;
    }
  }
  return agents;
}

}  // namespace pangea
