#pragma once

// From a bus or a log to the browsers, until a signal to stop. Throws std::runtime_error for a bus
// that cannot be opened, a log or a page that cannot be read, and a port that is taken.

#include <string>
#include <vector>

#include "viewer/viewer_process.h"
#include "web/web_server.h"

namespace pangea::viewer {

// `agent_urls`: buses of agents, for their images. `pages`: whether they may change anchors.
// `page`: folder of the built page.
void ServeBus(const std::string& url, const std::vector<std::string>& agent_urls,
              ViewerProcess::Pages pages, const web::WebOptions& options, const std::string& page);
// What of the log is lost is told on stderr at the start; returns the exit code (TellLosses).
int ServeLog(const std::string& log, const web::WebOptions& options, const std::string& page);

}  // namespace pangea::viewer
