#pragma once

// The gateway's buses, its page, its names; and its loop.

#include <string>
#include <vector>

#include "gateway/gateway_process.h"

namespace pangea {

struct GatewayArguments {
  std::string site;
  std::string bus, link;  // LCM URLs; empty: the site's
  web::WebOptions web{"0.0.0.0", 8443, {}};
  std::string certificate, key;  // files; empty: the gateway's own authority
  std::string page;              // folder; empty: the installed one
  std::vector<std::string> hosts;
  double recordings_gb = 1e-9 * static_cast<double>(GatewayProcess::kDefaultMaxRecordings);
};

// Serves until a signal. Throws std::runtime_error when it cannot begin.
void RunGateway(const GatewayArguments& arguments);

}  // namespace pangea
