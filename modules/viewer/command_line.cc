#include "viewer/command_line.h"

#include <CLI/CLI.hpp>
#include <filesystem>

#include "bus/process.h"
#include "options/command_line.h"
#include "viewer/serve.h"

namespace pangea::viewer {
namespace {

// The page's folder relative to the binary, which is the same in the build tree and installed.
std::filesystem::path DefaultPage() {
  const std::filesystem::path binary = std::filesystem::read_symlink("/proc/self/exe");
  return binary.parent_path().parent_path() / "share" / "pangea" / "viewer";
}

struct Arguments {
  std::string url = kDefaultBusUrl;
  std::vector<std::string> agent_urls;
  std::string log;
  bool read_only = false;
  std::string page = DefaultPage().string();
  web::WebOptions web;
};

void AddArguments(CLI::App& app, Arguments& a) {
  auto* bus_option =
      app.add_option("--bus", a.url, "LCM URL of the server bus")->capture_default_str();
  app.add_option("--agent-bus", a.agent_urls,
                 "LCM URL of an agent's own bus, for its images; repeatable");
  app.add_option("--log", a.log, "a captured log of a server bus instead, with a time slider")
      ->excludes(bus_option);
  app.add_option("--port", a.web.port, "TCP port of the page; 0 for a free one")
      ->capture_default_str();
  app.add_option("--listen", a.web.listen,
                 "address to listen on; 0.0.0.0 lets everybody on the network look")
      ->capture_default_str();
  app.add_option("--http-name,--name", a.web.names,
                 "a name of this machine by which browsers may ask for the page");
  app.add_flag("--read-only", a.read_only, "pages show anchors, and cannot change them");
  app.add_option("--page", a.page, "folder of the built page")->capture_default_str();
  app.footer(
      "Exit code: 0; 1 when it failed; 3 when something of the log is lost (it is damaged, or "
      "ends in the middle of an event): then what could be read was shown.");
}

}  // namespace

int RunCommandLine(int argc, char** argv) {
  CLI::App app("Shows a running system, or a captured log, in a browser", "pangea-viewer");
  AddVersion(app);
  Arguments a;
  AddArguments(app, a);
  CLI11_PARSE(app, argc, argv);
  InstallSignalHandlers();
  try {
    if (!a.log.empty()) {
      return ServeLog(a.log, a.web, a.page);
    }
    ServeBus(a.url, a.agent_urls,
             a.read_only ? ViewerProcess::Pages::kLook : ViewerProcess::Pages::kEdit, a.web,
             a.page);
    return 0;
  } catch (const std::exception& error) {
    return Failed("pangea-viewer", error);
  }
}

}  // namespace pangea::viewer
