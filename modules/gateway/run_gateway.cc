#include "gateway/run_gateway.h"

#include <fmt/format.h>

#include <ctime>
#include <filesystem>
#include <iostream>
#include <memory>
#include <stdexcept>

#include "bus/process.h"
#include "bus/status_log.h"
#include "files/text_file.h"
#include "gateway/machine_names.h"

namespace pangea {
namespace {

namespace fs = std::filesystem;

constexpr int64_t kTickInterval_us = 100'000;
constexpr int kServe_ms = 10;  // longest wait of a packet that goes down
constexpr int kMaxMessagesAtOnce = 500;
constexpr const char* kNoPageYet =
    "<!doctype html><meta charset=utf-8><meta name=viewport content=\"width=device-width\">"
    "<title>Pangea</title><p>This gateway works. Its page is not built: see docs/phone.md.";

// The page's folder relative to the binary, which is the same in the build tree and installed.
fs::path DefaultPage() {
  return fs::read_symlink("/proc/self/exe").parent_path().parent_path() / "share" / "pangea" /
         "phone";
}

web::Page PageOf(const std::string& folder) {
  if (!folder.empty()) {
    return web::ReadPage(folder, "give another --page");
  }
  if (Exists(DefaultPage() / "index.html")) {
    return web::ReadPage(DefaultPage(), "");
  }
  std::cout << fmt::format(
      "the phone's page is not built, there is nothing in {}: a line of text "
      "is served in its place\n",
      DefaultPage().string());
  const auto text = std::make_shared<const std::string>(kNoPageYet);
  return {{"/", {"text/html; charset=utf-8", text, nullptr}}};
}

GatewayIdentity IdentityOf(const GatewayArguments& arguments, const site::Site& site,
                           const MachineNames& names, const std::string& url_host) {
  if (arguments.certificate.empty() != arguments.key.empty()) {
    throw std::runtime_error("give --cert and --key together");
  }
  if (!arguments.certificate.empty()) {
    GatewayIdentity own = ReadIdentity(arguments.certificate, arguments.key);
    if (!IsFor(own.server.certificate_chain_pem, url_host)) {
      std::cout << fmt::format(
          "{} is not in the certificate: browsers refuse the link; give a --host that is\n",
          url_host);
    }
    return own;
  }
  GatewayIdentity identity = OpenIdentity(site, names, std::time(nullptr));
  for (const std::string& name : identity.left_out) {
    std::cout << fmt::format(
        "{} is not in the certificate: the gateway's authority vouches for private networks and "
        "the names and addresses it was made with (docs/phone.md)\n",
        name);
  }
  return identity;
}

// The host in the URL that phones are given.
std::string UrlHost(const GatewayArguments& arguments, const MachineNames& names) {
  if (!arguments.hosts.empty()) {
    return arguments.hosts.front();
  }
  const std::string& listen = arguments.web.listen;
  return listen == "0.0.0.0" || listen == "::" ? AddressForOthers(names) : listen;
}

void HandleWaiting(LcmBus& bus) {
  for (int n = 0; n < kMaxMessagesAtOnce && bus.Handle(0); ++n) {
  }
}

}  // namespace

void RunGateway(const GatewayArguments& arguments) {
  InstallSignalHandlers();
  site::Site site = site::OpenSite(arguments.site);
  site::SiteDescription& buses = site.description;
  buses.link = arguments.link.empty() ? buses.link : arguments.link;
  buses.bus = arguments.bus.empty() ? buses.bus : arguments.bus;
  MachineNames names = NamesOfThisMachine();
  for (const std::string& host : arguments.hosts) {
    AddTo(&names, host);
  }
  LcmBus link_bus(buses.link, LcmBus::Fragments::kRefused);
  LcmBus server_bus(buses.bus);
  MakeGatewayFolders(site);
  const std::string url_host = UrlHost(arguments, names);
  GatewayProcess::Options options{arguments.web, PageOf(arguments.page),
                                  IdentityOf(arguments, site, names, url_host), url_host,
                                  static_cast<int64_t>(1e9 * arguments.recordings_gb)};
  options.web.names = names.hosts;
  GatewayProcess process(link_bus, server_bus, site, options);
  StartLog("pangea-gateway",
           fmt::format("site {}, bus {}, link {}", site.folder.string(), buses.bus, buses.link));
  std::cout << fmt::format("{}\ncertificate's SHA-256: {}\n", process.address().url,
                           process.address().fingerprint)
            << std::flush;
  int64_t next_tick = 0;
  while (!StopRequested()) {
    if (const int64_t now = WallUtime(); now >= next_tick) {
      process.Tick(now, std::time(nullptr));
      next_tick = now + kTickInterval_us;
    }
    HandleWaiting(link_bus);
    HandleWaiting(server_bus);
    process.Serve(kServe_ms);
  }
}

}  // namespace pangea
