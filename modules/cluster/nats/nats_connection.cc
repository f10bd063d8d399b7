#include "cluster/nats/nats_connection.h"

#include <fmt/format.h>

#include <atomic>
#include <stdexcept>
#include <vector>

#include "bus/status_log.h"

namespace pangea {
namespace {

constexpr int64_t kReconnectWait_ms = 500;
constexpr int64_t kReconnectJitter_ms = 100;  // that of libnats for TLS is a second
// To notice that a host is gone, which is so after two pings without an answer.
constexpr int64_t kPing_ms = 1000;
// More than the largest event of a journal; nats-server's own default is four times as much.
constexpr int64_t kMinPayload = 256 * 1024;

std::string WhyNotConnected(natsStatus status, const NatsAccess& access) {
  const std::string& url = access.url;
  // If the server requires TLS, libnats tries it by itself, without a trusted authority.
  if (!access.tls() && (status == NATS_SSL_ERROR || status == NATS_SECURE_CONNECTION_REQUIRED)) {
    return fmt::format("NATS at {} takes TLS only: give --nats tls://HOST:4222 and --ca FILE", url);
  }
  switch (status) {
    case NATS_CONNECTION_AUTH_FAILED:
      return access.credentials.empty()
                 ? fmt::format("NATS at {} wants a user and a password: give --credentials FILE",
                               url)
                 : fmt::format(
                       "NATS at {} refuses the user of {}: another password, or none of its "
                       "users",
                       url, access.credentials.string());
    case NATS_SECURE_CONNECTION_WANTED:
      return fmt::format("NATS at {} has no TLS, and gets no password: see pangea-nats-config",
                         url);
    case NATS_SSL_ERROR:
      return fmt::format(
          "NATS at {}: its certificate is not of the authority in {}, or for "
          "another host: {}",
          url, access.ca.string(), nats_GetLastError(nullptr));
    default:
      return fmt::format(
          "cannot reach NATS at {}: {}; give --nats with its URL, or start it: "
          "nats-server -a 127.0.0.1 -js -sd FOLDER",
          url, natsStatus_GetText(status));
  }
}

// On a thread of libnats. What is refused is not answered, and asked again and again: said once.
void SayWhatIsRefused(natsConnection* connection, natsSubscription*, natsStatus status, void*) {
  static std::atomic_flag said;
  const char* text = nullptr;
  if (status == NATS_NOT_PERMITTED && !said.test_and_set()) {
    natsConnection_GetLastError(connection, &text);
    Log("pangea-bridge",
        fmt::format("NATS refuses its user: {}: are --credentials of this site and role, and "
                    "nats.conf as the newest pangea-nats-config makes it?",
                    text));
  }
}

NatsOwned<natsOptions> OptionsOf(const NatsAccess& access, const std::string& name,
                                 int64_t timeout_ms) {
  natsOptions* made = nullptr;
  natsOptions_Create(&made);
  NatsOwned<natsOptions> options(made);
  natsOptions_SetName(made, name.c_str());
  natsOptions_SetTimeout(made, timeout_ms);
  // Without it a write to a host that is gone blocks, and libnats' check of its pings with it.
  natsOptions_SetWriteDeadline(made, timeout_ms);
  natsOptions_SetErrorHandler(made, SayWhatIsRefused, nullptr);
  natsOptions_SetMaxReconnect(made, -1);
  natsOptions_SetReconnectWait(made, kReconnectWait_ms);
  natsOptions_SetReconnectJitter(made, kReconnectJitter_ms, kReconnectJitter_ms);
  natsOptions_SetPingInterval(made, kPing_ms);
  const std::vector<std::string> urls = access.Urls();
  std::vector<const char*> servers;
  for (const std::string& one : urls) {
    servers.push_back(one.c_str());
  }
  if (natsOptions_SetServers(made, servers.data(), static_cast<int>(servers.size())) != NATS_OK) {
    throw std::runtime_error(fmt::format("--nats {}: is no URL as tls://HOST:4222", access.url));
  }
  if (access.tls()) {
    natsOptions_SetSecure(made, true);
    if (natsOptions_LoadCATrustedCertificates(made, access.ca.c_str()) != NATS_OK) {
      throw std::runtime_error(
          fmt::format("--ca {}: cannot be read as certificates", access.ca.string()));
    }
  }
  if (!access.credentials.empty()) {
    const NatsCredentials credentials = ReadCredentials(access.credentials);
    natsOptions_SetUserInfo(made, credentials.user.c_str(), credentials.password.c_str());
    // A prefix for each user, so that other users cannot read the answers.
    natsOptions_SetCustomInboxPrefix(made, ("_INBOX." + credentials.user).c_str());
  }
  return options;
}

}  // namespace

NatsOwned<natsConnection> ConnectToNats(const NatsAccess& access, const std::string& name,
                                        int64_t timeout_ms) {
  access.Check();
  const NatsOwned<natsOptions> options = OptionsOf(access, name, timeout_ms);
  natsConnection* made = nullptr;
  const natsStatus status = natsConnection_Connect(&made, options.get());
  NatsOwned<natsConnection> connection(made);
  if (status != NATS_OK) {
    throw std::runtime_error(WhyNotConnected(status, access));
  }
  if (const int64_t payload = natsConnection_GetMaxPayload(made); payload < kMinPayload) {
    throw std::runtime_error(
        fmt::format("NATS at {} takes messages of {} bytes, and a site needs {}: raise max_payload "
                    "in its configuration",
                    access.url, payload, kMinPayload));
  }
  return connection;
}

}  // namespace pangea
