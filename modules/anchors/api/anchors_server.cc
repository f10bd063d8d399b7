#include "anchors/api/anchors_server.h"

#include <fmt/format.h>

#include <functional>
#include <iostream>

#include "web/web_rules.h"

namespace pangea {

web::WebOptions ListenAt(const std::string& address_and_port) {
  const auto [address, port] = web::AddressAndPort(address_and_port);
  return {address, port, {}, true};
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
