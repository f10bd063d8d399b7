#include "gateway/identity.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <system_error>

#include "files/text_file.h"
#include "files/whole_file.h"

namespace pangea {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr mode_t kPublic = 0644;
constexpr int kRenewBefore_days = 30;
constexpr int64_t kSecondsPerDay = 86'400;

// The key is written first, so that a certificate always has its key.
void WriteIdentity(const fs::path& folder, const std::string& name, const Identity& identity) {
  ReplaceFile(folder / (name + ".key"), identity.private_key_pem, kOwnerOnly);
  ReplaceFile(folder / (name + ".pem"), identity.certificate_chain_pem, kPublic);
}

Identity ReadPair(const fs::path& certificate, const fs::path& key) {
  return {ReadTextFile(certificate), ReadTextFile(key)};
}

Identity ReadAuthority(const fs::path& folder, int64_t now_s) {
  Identity read = ReadPair(folder / "ca.pem", folder / "ca.key");
  if (BeginOf(read.certificate_chain_pem) > now_s) {
    throw std::runtime_error(fmt::format("{}: begins after the date of this machine: set its clock",
                                         (folder / "ca.pem").string()));
  }
  if (!CanVouch(read, now_s, kRenewBefore_days)) {
    throw std::runtime_error(
        fmt::format("{}: is too old, or of another key than ca.key: move both away, and each phone "
                    "has to trust the new ones",
                    (folder / "ca.pem").string()));
  }
  return read;
}

Identity OpenAuthority(const site::Site& site, const MachineNames& names, int64_t now_s) {
  const fs::path folder = site.gateway();
  if (!Exists(folder / "ca.pem")) {
    const Identity made =
        MakeAuthority(fmt::format("Pangea {}", site.description.name), names, now_s);
    WriteIdentity(folder, "ca", made);
  }
  return ReadAuthority(folder, now_s);
}

void CheckDateOf(const GatewayIdentity& identity, int64_t now_s) {
  const int64_t expiry_s = ExpiryOf(identity.server.certificate_chain_pem);
  if (now_s + kRenewBefore_days * kSecondsPerDay >= expiry_s) {
    throw std::runtime_error(
        fmt::format("{}: this certificate {} on {:%Y-%m-%d}: restart the gateway with a newer one",
                    identity.file, now_s < expiry_s ? "expires" : "has expired",
                    fmt::gmtime(static_cast<std::time_t>(expiry_s))));
  }
}

}  // namespace

GatewayIdentity OpenIdentity(const site::Site& site, const MachineNames& names, int64_t now_s) {
  const fs::path folder = site.gateway();
  const Identity authority = OpenAuthority(site, names, now_s);
  MadeCertificate made = MakeServerCertificate(authority, names, now_s);
  GatewayIdentity identity{made.identity, authority.certificate_chain_pem, made.left_out, names,
                           (folder / "server.pem").string()};
  const auto is_left_out = [&](const std::string& name) {
    return std::ranges::count(made.left_out, name) > 0;
  };
  std::erase_if(identity.names.hosts, is_left_out);
  std::erase_if(identity.names.addresses, is_left_out);
  if (Exists(folder / "server.pem") && Exists(folder / "server.key")) {
    const Identity kept = ReadPair(folder / "server.pem", folder / "server.key");
    if (IsGoodFor(kept, authority, identity.names, now_s, kRenewBefore_days)) {
      identity.server = kept;
      return identity;
    }
  }
  WriteIdentity(folder, "server", identity.server);
  return identity;
}

GatewayIdentity ReadIdentity(const std::string& certificate_file, const std::string& key_file) {
  return {ReadPair(certificate_file, key_file), "", {}, {}, certificate_file};
}

std::optional<Identity> RenewIdentity(const site::Site& site, const GatewayIdentity& identity,
                                      int64_t now_s) {
  if (identity.authority_pem.empty()) {
    CheckDateOf(identity, now_s);
    return std::nullopt;
  }
  if (IsGoodFor(identity.server, {identity.authority_pem, ""}, identity.names, now_s,
                kRenewBefore_days)) {
    return std::nullopt;
  }
  const Identity authority = ReadAuthority(site.gateway(), now_s);
  if (authority.certificate_chain_pem != identity.authority_pem) {
    throw std::runtime_error(
        fmt::format("{}: is another one than at the start: restart the gateway",
                    (site.gateway() / "ca.pem").string()));
  }
  const Identity made = MakeServerCertificate(authority, identity.names, now_s).identity;
  WriteIdentity(site.gateway(), "server", made);
  return made;
}

void WriteAddress(const site::Site& site, const GatewayAddress& address) {
  const json written = {{"url", address.url}, {"fingerprint", address.fingerprint}};
  ReplaceFile(site.gateway() / "address.json", written.dump() + "\n", kPublic);
}

GatewayAddress ReadAddress(const site::Site& site) {
  const fs::path file = site.gateway() / "address.json";
  std::error_code error;
  const bool is_there = fs::exists(file, error);
  if (error) {
    throw std::runtime_error(fmt::format("{}: cannot be read: {}; run as the site's owner",
                                         file.string(), error.message()));
  }
  if (!is_there) {
    throw std::runtime_error(
        fmt::format("{}: is not there: the gateway never ran on this site; start it first: "
                    "pangea-server --site {} --phone",
                    file.string(), site.folder.string()));
  }
  const json read = json::parse(ReadTextFile(file), nullptr, false);
  if (!read.is_object() || !read.contains("url") || !read["url"].is_string() ||
      !read.contains("fingerprint") || !read["fingerprint"].is_string()) {
    throw std::runtime_error(
        fmt::format("{}: is not as the gateway wrote it: remove it, and start the gateway again",
                    file.string()));
  }
  return {read["url"], read["fingerprint"]};
}

}  // namespace pangea
