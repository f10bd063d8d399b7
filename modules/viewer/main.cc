// pangea-viewer: shows a bus or a log in a browser.

#include <CLI/CLI.hpp>
#include <filesystem>

#include "bus/process.h"
#include "options/command_line.h"
#include "viewer/serve.h"

namespace {

using namespace pangea;
using namespace pangea::viewer;

// The page's folder relative to the binary, which is the same in the build tree and installed.
std::filesystem::path DefaultPage() {
  const std::filesystem::path binary = std::filesystem::read_symlink("/proc/self/exe");
  return binary.parent_path().parent_path() / "share" / "pangea" / "viewer";
}

}  // namespace

int main(int argc, char** argv) {
  std::string url = pangea::kDefaultBusUrl;
  std::vector<std::string> agent_urls;
  std::string log;
  bool read_only = false;
  std::string page = DefaultPage().string();
  pangea::web::WebOptions options;
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
  app.add_option("--http-name,--name", options.names,
                 "a name of this machine by which browsers may ask for the page");
  app.add_flag("--read-only", read_only, "pages show anchors, and cannot change them");
  app.add_option("--page", page, "folder of the built page")->capture_default_str();
  app.footer(
      "Exit code: 0; 1 when it failed; 3 when something of the log is lost (it is damaged, or "
      "ends in the middle of an event): then what could be read was shown.");
  CLI11_PARSE(app, argc, argv);
  InstallSignalHandlers();
  try {
    if (log.empty()) {
      ServeBus(url, agent_urls,
               read_only ? ViewerProcess::Pages::kLook : ViewerProcess::Pages::kEdit, options,
               page);
    } else {
      return ServeLog(log, options, page);
    }
  } catch (const std::exception& error) {
    return pangea::Failed("pangea-viewer", error);
  }
  return 0;
}
