#include "web/web_rules.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <strings.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cstdint>
#include <stdexcept>

namespace pangea::web {
namespace {

bool IsAddress(const std::string& text) {
  std::array<unsigned char, sizeof(in6_addr)> address{};
  if (text.size() > 2 && text.front() == '[' && text.back() == ']') {
    return inet_pton(AF_INET6, text.substr(1, text.size() - 2).c_str(), address.data()) == 1;
  }
  return inet_pton(AF_INET, text.c_str(), address.data()) == 1;
}

// Names of hosts have no case, and browsers send them in small letters (RFC 4343).
bool IsSameName(const std::string& a, const std::string& b) {
  return strcasecmp(a.c_str(), b.c_str()) == 0;
}

bool IsPort(std::string_view text) {
  uint16_t port = 0;
  const char* const end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, port);
  return error == std::errc() && stop == end && port > 0;
}

}  // namespace

bool HostAllowed(std::string_view host, const std::vector<std::string>& names) {
  const size_t bracket = host.rfind(']');
  const size_t colon = host.rfind(':');
  const bool has_port =
      colon != std::string_view::npos && (bracket == std::string_view::npos || colon > bracket);
  if (has_port && !IsPort(host.substr(colon + 1))) {
    return false;
  }
  const std::string name(has_port ? host.substr(0, colon) : host);
  return IsSameName(name, "localhost") || IsAddress(name) ||
         std::ranges::any_of(names, [&name](const auto& other) { return IsSameName(name, other); });
}

std::string HostInUrl(const std::string& host) {
  return host.find(':') == std::string::npos ? host : fmt::format("[{}]", host);
}

bool OriginAllowed(std::string_view origin, std::string_view host) {
  return !host.empty() &&
         (origin == fmt::format("http://{}", host) || origin == fmt::format("https://{}", host));
}

bool IsOrigin(std::string_view text) {
  for (const std::string_view scheme : {"http://", "https://"}) {
    if (text.starts_with(scheme)) {
      const std::string_view host = text.substr(scheme.size());
      return !host.empty() && std::ranges::all_of(host, [](unsigned char c) {
        return std::isalnum(c) != 0 || c == '.' || c == '-' || c == ':' || c == '[' || c == ']';
      });
    }
  }
  return false;
}

void CheckOrigins(const std::vector<std::string>& origins) {
  for (const std::string& origin : origins) {
    if (!IsOrigin(origin)) {
      throw std::runtime_error(fmt::format(
          "--allow-origin {}: give scheme and host alone, as https://app.example", origin));
    }
  }
}

std::pair<std::string, uint16_t> AddressAndPort(const std::string& text) {
  const size_t colon = std::min(text.rfind(':'), text.size());
  const char* const end = text.data() + text.size();
  uint16_t port = 0;
  const auto [stop, error] = std::from_chars(std::min(text.data() + colon + 1, end), end, port);
  if (colon == 0 || error != std::errc() || stop != end) {
    throw std::runtime_error(fmt::format("--http {}: give ADDRESS:PORT, as 127.0.0.1:8090", text));
  }
  std::string address = text.substr(0, colon);
  if (address.front() == '[' && address.back() == ']') {
    address = address.substr(1, address.size() - 2);
  }
  return {address, port};
}

}  // namespace pangea::web
