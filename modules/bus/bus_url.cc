#include "bus/bus_url.h"

#include <fmt/format.h>

#include <stdexcept>

#include "bus/transport/udpm_socket.h"

namespace pangea {

std::string WhyNoBus(const std::string& url) {
  if (url.starts_with("tcpq://")) {
    return "";
  }
  if (!url.starts_with("udpm://")) {
    return fmt::format(
        "'{}' is no LCM URL between processes: give udpm://GROUP:PORT?ttl=N, or tcpq://HOST:PORT",
        url);
  }
  try {
    ParseUdpmUrl(url);
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "";
}

bool IsOneBus(const std::string& url, const std::string& other_url) {
  return url.substr(0, url.find('?')) == other_url.substr(0, other_url.find('?'));
}

void RequireTwoBuses(const std::string& option, const std::string& url,
                     const std::string& other_option, const std::string& other_url) {
  if (IsOneBus(url, other_url)) {
    throw std::runtime_error(
        fmt::format("{} and {} are both {}: give two LCM URLs that differ before the '?'", option,
                    other_option, url));
  }
}

}  // namespace pangea
