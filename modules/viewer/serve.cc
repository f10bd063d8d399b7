#include "viewer/serve.h"

#include <fmt/format.h>

#include <iostream>
#include <memory>

#include "bus/process.h"
#include "viewer/log_show.h"
#include "viewer/web/page_site.h"
#include "web/web_rules.h"

namespace pangea::viewer {
namespace {

constexpr int kServe_ms = 20;
constexpr int kMaxMessagesAtOnce = 500;
constexpr const char* kNoPage = "scripts/viewer builds it (with npm), or give --page FOLDER";

void Announce(const web::WebServer& server, const web::WebOptions& options) {
  std::cout << fmt::format("http://{}:{}/\n", web::HostInUrl(options.listen), server.port())
            << std::flush;
}

void HandleWaiting(LcmBus& bus) {
  for (int n = 0; n < kMaxMessagesAtOnce && bus.Handle(0); ++n) {
  }
}

}  // namespace

void ServeBus(const std::string& url, const std::vector<std::string>& agent_urls,
              ViewerProcess::Pages pages, const web::WebOptions& options, const std::string& page) {
  LcmBus bus(url);
  ViewerProcess process(bus, url, WallUtime(), pages);
  std::vector<std::unique_ptr<LcmBus>> agent_buses;
  for (const std::string& agent_url : agent_urls) {
    agent_buses.push_back(std::make_unique<LcmBus>(agent_url));
    process.WatchAgent(*agent_buses.back());
  }
  PageSite site(web::ReadPage(page, kNoPage), process);
  web::WebServer server(options, site);
  Announce(server, options);
  while (!StopRequested()) {
    HandleWaiting(bus);
    for (const auto& agent_bus : agent_buses) {
      HandleWaiting(*agent_bus);
    }
    process.Tick(WallUtime());
    server.Serve(kServe_ms);
  }
}

int ServeLog(const std::string& log, const web::WebOptions& options, const std::string& page) {
  LogShow show(log);
  const int exit_code = TellLosses("pangea-viewer", show.readings(), 0);
  PageSite site(web::ReadPage(page, kNoPage), show);
  web::WebServer server(options, site);
  Announce(server, options);
  int64_t now = WallUtime();
  while (!StopRequested()) {
    const int64_t before = now;
    now = WallUtime();
    show.Advance(1e-6 * static_cast<double>(now - before));
    server.Serve(kServe_ms);
  }
  return exit_code;
}

}  // namespace pangea::viewer
