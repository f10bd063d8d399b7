#pragma once

// Whom the server answers. It listens on this machine only, but every web page the user has open
// could still reach it: one whose name was pointed at 127.0.0.1 (DNS rebinding) gives that name as
// the host, and one from elsewhere that opens a socket here gives its own origin.

#include <string>
#include <string_view>
#include <vector>

namespace pangea::web {

// The Host header names an address, "localhost", or one of `names`; with a port, 1 to 65535 in
// digits, or without. So nothing else of it gets into the answer's headers.
bool HostAllowed(std::string_view host, const std::vector<std::string>& names);

// The Origin header is of a page that this server itself gave out under `host`.
bool OriginAllowed(std::string_view origin, std::string_view host);

// What a browser may give as its page's origin: "https://app.example" or "http://10.0.0.7:5173",
// without a path.
bool IsOrigin(std::string_view text);

// Throws std::runtime_error, naming --allow-origin, for one that is none.
void CheckOrigins(const std::vector<std::string>& origins);

}  // namespace pangea::web
