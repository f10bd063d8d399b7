#include "anchors/api/anchors_server.h"

#include <fmt/format.h>

#include <functional>
#include <iostream>
#include <limits>
#include <stdexcept>

#include "web/web_rules.h"

namespace pangea {

web::WebOptions ListenAt(const std::string& address_and_port) {
  const size_t colon = address_and_port.rfind(':');
  const auto port = colon == std::string::npos
                        ? std::nullopt
                        : ParseNumber(std::string_view(address_and_port).substr(colon + 1),
                                      std::numeric_limits<uint16_t>::max());
  if (!port || colon == 0) {
    throw std::runtime_error(
        fmt::format("--http {}: give ADDRESS:PORT, as 127.0.0.1:8090", address_and_port));
  }
  std::string address = address_and_port.substr(0, colon);
  if (address.front() == '[' && address.back() == ']') {
    address = address.substr(1, address.size() - 2);
  }
  return {address, static_cast<uint16_t>(*port), {}, true};
}

AnchorsServer::AnchorsServer(Bus& bus, const AnchorsOptions& options,
                             std::shared_ptr<RecordStore> records,
                             const web::WebOptions& web_options)
    : process_(bus, options, std::move(records)),
      api_(process_.anchors(), options, [this](const AnchorEdit& edit) { process_.Request(edit); }),
      server_(web_options, api_) {
  process_.OnEditTaken(std::bind_front(&AnchorApi::Take, &api_));
  std::cout << fmt::format("http://{}:{}/v1/\n", web::HostInUrl(web_options.listen), port())
            << std::flush;
}

void AnchorsServer::BetweenMessages(int64_t now_utime) {
  api_.Tick(now_utime, process_.is_complete());
  server_.Serve(0);
}

}  // namespace pangea
