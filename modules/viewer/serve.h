#pragma once

// Serves a bus or a log to browsers until a signal. Throws std::runtime_error if the bus cannot be
// opened, the log or the page cannot be read, or the port is in use.

#include <string>
#include <vector>

#include "viewer/viewer_process.h"
#include "web/web_server.h"

namespace pangea::viewer {

// `agent_urls`: buses of agents, for their images. `pages`: whether pages may change anchors.
// `page`: folder of the built page.
void ServeBus(const std::string& url, const std::vector<std::string>& agent_urls,
              ViewerProcess::Pages pages, const web::WebOptions& options, const std::string& page);
// Losses of the log are reported on stderr at the start. Returns the exit code (TellLosses).
int ServeLog(const std::string& log, const web::WebOptions& options, const std::string& page);

}  // namespace pangea::viewer
