#include "gateway/command_line.h"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <iostream>
#include <map>
#include <memory>
#include <set>
#include <stdexcept>

#include "gateway/admission.h"
#include "gateway/identity.h"
#include "gateway/qr_code.h"
#include "gateway/run_gateway.h"
#include "link/agent_key.h"
#include "options/command_line.h"

namespace pangea::gateway {
namespace {

struct Arguments {
  std::string site;
  std::string name;
  std::string rights = "own";
  int64_t expires_s = 3600;
  int32_t agent_id = 0;
};
using Shared = std::shared_ptr<Arguments>;

int64_t NowSeconds() {
  return std::chrono::duration_cast<std::chrono::seconds>(
             std::chrono::system_clock::now().time_since_epoch())
      .count();
}

std::string Date(int64_t seconds) {
  return fmt::format("{:%Y-%m-%d %H:%M} UTC", fmt::gmtime(static_cast<std::time_t>(seconds)));
}

void MakeInvite(const Arguments& arguments) {
  const site::Site site = site::ReadSite(arguments.site);
  const GatewayAddress address = ReadAddress(site);
  if (!IsVisitorName(arguments.name)) {
    throw std::runtime_error(
        fmt::format("--name: give at most {} bytes of UTF-8 that can be shown", kMaxVisitorName));
  }
  const int64_t now_s = NowSeconds();
  const int64_t expires_s = now_s + arguments.expires_s;
  Admission admission(site);
  admission.Invites(now_s);  // removes the expired ones, so that they take no room
  const std::string code =
      admission.Make({arguments.name, AnchorRightOf(arguments.rights).value(), expires_s});
  const std::string url = fmt::format("{}#join={}", address.url, code);
  std::cout << fmt::format("{}\ncode {}, for one agent, until {}\n{}\ncertificate's SHA-256: {}\n",
                           QrCode(url, isatty(STDOUT_FILENO) == 1), code, Date(expires_s), url,
                           address.fingerprint);
}

void RevokeAgent(const Arguments& arguments) {
  Admission(site::ReadSite(arguments.site)).Revoke(arguments.agent_id);
  std::cout << fmt::format(
      "agent {} has no key any more; the server shuts it out within a second, its map stays\n",
      arguments.agent_id);
}

void List(const Arguments& arguments) {
  const site::Site site = site::ReadSite(arguments.site);
  Admission admission(site);
  const auto joined = admission.Agents();
  KeyFolder folder(site.keys());
  const auto keys = folder.Read();
  for (const std::string& file : folder.unusable()) {
    std::cerr << fmt::format("pangea-gateway: {}\n", file);
  }
  std::set<int32_t> agents;
  for (const auto& [agent_id, agent] : joined) {
    agents.insert(agent_id);
  }
  for (const auto& [agent_id, key] : keys) {
    agents.insert(agent_id);
  }
  for (const int32_t agent_id : agents) {
    const auto key = keys.find(agent_id);
    const auto agent = joined.find(agent_id);
    std::cout << fmt::format(
        "agent {:<6} {:<7} {}\n", agent_id,
        key == keys.end() ? "revoked" : WordOf(key->second.anchors),
        agent == joined.end()
            ? "key made by hand"
            : fmt::format("joined {}  {}", Date(agent->second.joined_s), agent->second.name));
  }
  for (const Invite& invite : admission.Invites(NowSeconds())) {
    std::cout << fmt::format("invite       {:<7} until  {}  {}\n", WordOf(invite.anchors),
                             Date(invite.expires_s), invite.name);
  }
}

CLI::App* AddSiteCommand(CLI::App& app, const std::string& name, const std::string& help,
                         const Shared& arguments) {
  CLI::App* command = app.add_subcommand(name, help);
  command->add_option("--site", arguments->site, "the site's folder")->required();
  return command;
}

void AddSubcommands(CLI::App& app) {
  const auto arguments = std::make_shared<Arguments>();
  CLI::App* invite = AddSiteCommand(
      app, "invite", "Prints a code that lets one agent join: as text, link and QR code",
      arguments);
  invite->add_option("--name", arguments->name, "of the visitor, if they give none");
  const std::map<std::string, int64_t> units{{"s", 1}, {"m", 60}, {"h", 3600}, {"d", 86'400}};
  invite->add_option("--expires", arguments->expires_s, "for so long it can be used: 30m, 1h, 7d")
      ->transform(CLI::AsNumberWithUnit(units, CLI::AsNumberWithUnit::UNIT_REQUIRED))
      ->check(CLI::Range(int64_t{1}, int64_t{366} * 86'400))
      ->default_str("1h");
  invite
      ->add_option("--rights", arguments->rights,
                   "what the agent may do with anchors: read, own (edit those it made), write "
                   "(edit all)")
      ->capture_default_str()
      ->check(CLI::IsMember({"read", "own", "write"}));
  invite->callback([arguments] { MakeInvite(*arguments); });

  CLI::App* revoke = AddSiteCommand(
      app, "revoke", "Takes an agent's key away; its map and its anchors stay", arguments);
  revoke->add_option("agent", arguments->agent_id, "its id")
      ->required()
      ->check(CLI::Range(1, 65535));
  revoke->callback([arguments] { RevokeAgent(*arguments); });

  CLI::App* list =
      AddSiteCommand(app, "list", "Agents, what they may do, and open invites", arguments);
  list->callback([arguments] { List(*arguments); });
}

// The options of the gateway itself, and its subcommands, which run when the app parses them.
void AddArguments(CLI::App& app, GatewayArguments* arguments) {
  app.add_option("--site", arguments->site, "the site's folder");
  app.add_option("--bus", arguments->bus, "LCM URL of the server bus (default: the site's)");
  app.add_option("--link", arguments->link, "LCM URL of the link bus (default: the site's)");
  app.add_option("--listen", arguments->web.listen, "address to listen on")->capture_default_str();
  app.add_option("--port", arguments->web.port, "TCP port; 0 for a free one")
      ->capture_default_str();
  app.add_option("--host", arguments->hosts,
                 "a name or address by which browsers reach this machine; the first is in the link "
                 "that `invite` prints; repeatable");
  app.add_option("--cert", arguments->certificate,
                 "your own certificate and those that vouch for it (PEM), in place of the "
                 "gateway's own authority");
  app.add_option("--key", arguments->key, "... and its key (PEM)");
  app.add_option("--page", arguments->page,
                 "folder of the built page (default: the installed one)");
  app.add_option("--recordings-gb", arguments->recordings_gb,
                 "so much of the recordings that pages upload is kept; 0: none")
      ->capture_default_str()
      ->check(Within(0, 1e6));
  app.require_subcommand(0, 1);
  AddSubcommands(app);
}

}  // namespace

int RunCommandLine(int argc, char** argv) {
  CLI::App app(
      "Serves the phone's page, lets agents join by a code, and carries their link packets",
      "pangea-gateway");
  AddVersion(app);
  GatewayArguments arguments;
  AddArguments(app, &arguments);
  try {
    app.parse(argc, argv);
    if (!app.get_subcommands().empty()) {
      return 0;  // the subcommand has run while parsing
    }
    if (arguments.site.empty()) {
      throw std::runtime_error("give --site FOLDER");
    }
    RunGateway(arguments);
  } catch (const CLI::ParseError& error) {
    return app.exit(error);
  } catch (const std::exception& error) {
    return Failed("pangea-gateway", error);
  }
  return 0;
}

}  // namespace pangea::gateway
