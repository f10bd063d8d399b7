#include "gateway/gateway_process.h"

#include <fmt/format.h>

#include <exception>
#include <utility>

#include "bus/process.h"
#include "link/wire.h"
#include "messages/channels.h"
#include "web/web_rules.h"

namespace pangea {
namespace {

constexpr int64_t kSecond_us = 1'000'000;
constexpr int64_t kHour_us = 3600 * kSecond_us;

web::WebOptions WithIdentity(const GatewayProcess::Options& options) {
  web::WebOptions web = options.web;
  web.tls = options.identity.server;
  web.for_programs = true;  // refuse pages of other origins; an agent need not be a page
  web.max_peers = Gateway::kMaxPeers;
  return web;
}

Gateway::Public PublicOf(const site::Site& site, const GatewayProcess::Options& options) {
  const std::string& authority = options.identity.authority_pem;
  return {site.description.name, OurSoftware(), options.page,
          authority.empty() ? "" : ToDer(authority)};
}

GatewayAddress AddressOf(const GatewayProcess::Options& options, uint16_t port) {
  const GatewayIdentity& identity = options.identity;
  return {fmt::format("https://{}:{}/", web::HostInUrl(options.url_host), port),
          Fingerprint(identity.authority_pem.empty() ? identity.server.certificate_chain_pem
                                                     : identity.authority_pem)};
}

}  // namespace

GatewayProcess::GatewayProcess(Bus& link_bus, Bus& server_bus, const site::Site& site,
                               const Options& options)
    : link_bus_(link_bus),
      site_(site),
      identity_(options.identity),
      node_(server_bus, "gateway"),
      admission_(site),
      key_folder_(site.keys()),
      recordings_(site.recordings(), options.max_recordings),
      gateway_(PublicOf(site, options), Events(), recordings_),
      server_(WithIdentity(options), gateway_),
      address_(AddressOf(options, server_.port())) {
  node_.Watch(link_bus);
  link_bus.Subscribe(
      std::string(channels::kAllLinkDowns), [this](const std::string& channel, Bytes data) {
        gateway_.SendDown(channels::AgentOf(channel, channels::kLinkDownPrefix), data);
      });
  gateway_.SetNow(SteadyMicros());
  ReadAgents();
  WriteAddress(site, address_);
}

Gateway::Events GatewayProcess::Events() {
  return {[this](const JoinRequest& request) { return Join(request); },
          [this](int32_t agent_id, Bytes packet) {
            node_.Count("packets_up");
            link_bus_.Publish(channels::LinkUp(agent_id), packet);
          },
          [this](const std::string& why) { node_.Refuse(why); }, [this] { node_.NoteDropped(); }};
}

JoinResult GatewayProcess::Join(const JoinRequest& request) {
  try {
    JoinResult result = admission_.Join(request, date_s_);
    if (result.status == 200) {
      node_.Count("joined");
      LookForKeys();  // so that the new agent can connect at once
    }
    return result;
  } catch (const std::exception& error) {
    Log(node_.name(), error.what());
    return {500, "The server could not write your key. Tell whoever runs it.", 0, ""};
  }
}

void GatewayProcess::ReadAgents() {
  const auto joined = admission_.Agents();
  const auto keys = key_folder_.Read();
  for (const std::string& file : key_folder_.unusable()) {
    node_.Refuse(file);
  }
  agents_.clear();
  for (const auto& [agent_id, read] : keys) {
    const auto named = joined.find(agent_id);
    agents_.insert_or_assign(
        agent_id, Gateway::Agent{read.key, named == joined.end() ? "" : named->second.name});
  }
  gateway_.SetAgents(agents_);
}

// As the agent_handler does: if the folder cannot be read, all keys stay valid, except those whose
// own file was removed.
void GatewayProcess::LookForKeys() {
  try {
    if (key_folder_.Changed()) {
      ReadAgents();
    }
  } catch (const std::exception& error) {
    node_.Refuse(error.what());
    std::erase_if(agents_, [&](const auto& item) { return key_folder_.IsGone(item.first); });
    gateway_.SetAgents(agents_);
  }
}

// While it fails, the present certificate is used.
void GatewayProcess::RenewCertificate() {
  try {
    if (const auto renewed = RenewIdentity(site_, identity_, date_s_)) {
      server_.UseIdentity(*renewed);
      identity_.server = *renewed;
      node_.Count("certificates_renewed");
    }
  } catch (const std::exception& error) {
    node_.Refuse(error.what());
  }
}

void GatewayProcess::Serve(int timeout_ms) {
  gateway_.SetNow(SteadyMicros());
  server_.Serve(timeout_ms);
}

void GatewayProcess::Tick(int64_t now_utime, int64_t date_s) {
  date_s_ = date_s;
  if (now_utime >= next_look_utime_) {
    next_look_utime_ = now_utime + kSecond_us;
    LookForKeys();
    PublishStatus(now_utime);
  }
  if (now_utime >= next_renewal_utime_) {
    next_renewal_utime_ = now_utime + kHour_us;
    RenewCertificate();
  }
}

void GatewayProcess::PublishStatus(int64_t now_utime) {
  node_.Set("connected", gateway_.num_connected());
  // The viewer shows this summary, with address and fingerprint.
  node_.PublishStatus(
      now_utime, 0,
      fmt::format("{} (certificate's SHA-256 {}): {} of {} agents connected", address_.url,
                  address_.fingerprint, gateway_.num_connected(), agents_.size()));
}

}  // namespace pangea
