#include "cluster/nats/nats_access.h"

#include <fmt/format.h>

#include <algorithm>
#include <sstream>
#include <stdexcept>

#include "files/text_file.h"

namespace pangea {
namespace {

namespace fs = std::filesystem;

constexpr char kTls[] = "tls://";

}  // namespace

std::vector<std::string> NatsAccess::Urls() const {
  std::vector<std::string> urls;
  std::istringstream text(url);
  for (std::string one; std::getline(text, one, ',');) {
    urls.push_back(one);
  }
  return urls;
}

bool NatsAccess::tls() const {
  return std::ranges::all_of(Urls(), [](const std::string& one) { return one.starts_with(kTls); });
}

void NatsAccess::Check() const {
  if (!credentials.empty() && !tls()) {
    throw std::runtime_error(fmt::format(
        "--credentials: {} would show the password to the network: give tls://HOST:4222", url));
  }
  if (url.find(kTls) != std::string::npos && (!tls() || ca.empty())) {
    throw std::runtime_error(
        fmt::format("--nats {}: tls:// for all of them or none, and with it --ca FILE", url));
  }
}

NatsCredentials ReadCredentials(const fs::path& file) {
  std::istringstream text(ReadTextFile(file.string()));
  if ((fs::status(file).permissions() & (fs::perms::group_all | fs::perms::others_all)) !=
      fs::perms::none) {
    throw std::runtime_error(
        fmt::format("{}: others can read the password: chmod 600", file.string()));
  }
  NatsCredentials credentials;
  std::string user, password;
  text >> user >> credentials.user >> password >> credentials.password;
  if (!text || user != "user:" || password != "password:") {
    throw std::runtime_error(fmt::format(
        "{}: is no file of credentials: two lines, user: NAME and password: WORD", file.string()));
  }
  return credentials;
}

}  // namespace pangea
