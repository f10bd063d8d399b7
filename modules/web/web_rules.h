#pragma once

// Which requests the server answers. Even a server that listens only on this machine can be reached
// by every web page that the user has open. A page whose name was pointed at 127.0.0.1 (DNS
// rebinding) is recognised by its Host header, any other foreign page by its Origin header.

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace pangea::web {

// Whether the Host header is an address, "localhost" or one of `names`, with or without a port (1
// to 65535 in digits). So no other text from it gets into the answer's headers.
bool HostAllowed(std::string_view host, const std::vector<std::string>& names);

// The host as a URL has it: an IPv6 address is in brackets.
std::string HostInUrl(const std::string& host);

// Whether the Origin header is that of a page which this server itself served under `host`.
bool OriginAllowed(std::string_view origin, std::string_view host);

// Whether the text is an origin as browsers send it, without a path: "https://app.example" or
// "http://10.0.0.7:5173".
bool IsOrigin(std::string_view text);

// Throws std::runtime_error, with the option's name --allow-origin, if a text is not an origin.
void CheckOrigins(const std::vector<std::string>& origins);

// Parses "127.0.0.1:8090" or "[::1]:8090"; the address is without brackets. Throws
// std::runtime_error, with the option's name --http, if the text is not an address and port.
std::pair<std::string, uint16_t> AddressAndPort(const std::string& text);

}  // namespace pangea::web
