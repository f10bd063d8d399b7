#pragma once

// Opens the gateway's buses, page and certificates, and runs its main loop.

#include <string>
#include <vector>

#include "gateway/gateway_process.h"
#include "gateway/machine_names.h"

namespace pangea {

struct GatewayArguments {
  std::string site;
  std::string bus, link;  // LCM URLs; empty: those of the site
  web::WebOptions web{AnyAddress(), 8443, {}};
  std::string certificate, key;  // files; empty: the gateway's own authority
  std::string page;              // folder; empty: the installed one
  std::vector<std::string> hosts;
  double recordings_gb = 1e-9 * static_cast<double>(GatewayProcess::kDefaultMaxRecordings);
};

// Serves until a signal. Throws std::runtime_error when it cannot start.
void RunGateway(const GatewayArguments& arguments);

}  // namespace pangea
