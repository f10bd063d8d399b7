// pangea-viewer: a bus or a log, in a browser.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <iostream>
#include <memory>
#include <vector>

#include "common/bus/process.h"
#include "viewer/log_show.h"
#include "viewer/viewer_process.h"
#include "viewer/web_server.h"

namespace {

using namespace pangea;
using namespace pangea::viewer;

constexpr int kServe_ms = 20;
constexpr int kMaxMessagesAtOnce = 500;

// The page lies beside the binary, in the build tree as in an installation.
std::filesystem::path DefaultPage() {
  const std::filesystem::path binary = std::filesystem::read_symlink("/proc/self/exe");
  return binary.parent_path().parent_path() / "share" / "pangea" / "viewer";
}

void Announce(const WebServer& server, const WebOptions& options) {
  std::cout << fmt::format("http://{}:{}/\n", options.listen, server.port()) << std::flush;
}

void HandleWaiting(LcmBus& bus) {
  for (int n = 0; n < kMaxMessagesAtOnce && bus.Handle(0); ++n) {
  }
}

void ShowBus(const std::string& url, const std::vector<std::string>& agent_urls,
             const WebOptions& options, const std::string& page) {
  LcmBus bus(url);
  ViewerProcess process(bus, url, WallUtime());
  std::vector<std::unique_ptr<LcmBus>> agent_buses;
  for (const std::string& agent_url : agent_urls) {
    agent_buses.push_back(std::make_unique<LcmBus>(agent_url));
    process.WatchAgent(*agent_buses.back());
  }
  WebServer server(options, ReadPage(page), process);
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

void ShowLog(const std::string& log, const WebOptions& options, const std::string& page) {
  LogShow show(log);
  WebServer server(options, ReadPage(page), show);
  Announce(server, options);
  int64_t now = WallUtime();
  while (!StopRequested()) {
    const int64_t before = now;
    now = WallUtime();
    show.Advance(1e-6 * static_cast<double>(now - before));
    server.Serve(kServe_ms);
  }
}

}  // namespace

int main(int argc, char** argv) {
  std::string url = pangea::kDefaultBusUrl;
  std::vector<std::string> agent_urls;
  std::string log;
  std::string page = DefaultPage().string();
  WebOptions options;
  CLI::App app("Shows a running system, or a captured log, in a browser", "pangea-viewer");
  auto* bus_option =
      app.add_option("--bus", url, "LCM URL of the server bus")->capture_default_str();
  app.add_option("--agent-bus", agent_urls,
                 "LCM URL of an agent's own bus, for its images; repeatable");
  app.add_option("--log", log, "a captured log of a server bus instead, with a time slider")
      ->excludes(bus_option);
  app.add_option("--port", options.port, "TCP port of the page; 0 for a free one")
      ->capture_default_str();
  app.add_option("--listen", options.listen,
                 "address to listen on; 0.0.0.0 lets everybody on the network look")
      ->capture_default_str();
  app.add_option("--name", options.names,
                 "a name of this machine by which browsers may ask for the page");
  app.add_option("--page", page, "folder of the built page")->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  InstallSignalHandlers();
  try {
    if (log.empty()) {
      ShowBus(url, agent_urls, options, page);
    } else {
      ShowLog(log, options, page);
    }
  } catch (const std::exception& error) {
    std::cerr << fmt::format("pangea-viewer: {}\n", error.what());
    return 1;
  }
  return 0;
}
