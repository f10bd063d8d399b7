#pragma once

// Whom the server answers. It listens on this machine only, but every web page the user has open
// could still reach it: one whose name was pointed at 127.0.0.1 (DNS rebinding) gives that name as
// the host, and one from elsewhere that opens a socket here gives its own origin.

#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace pangea::viewer {

// The Host header names an address, "localhost", or one of `names`; with a port, 1 to 65535 in
// digits, or without. So nothing else of it gets into the answer's headers.
bool HostAllowed(std::string_view host, const std::vector<std::string>& names);

// The Origin header is of a page that this server itself gave out under `host`.
bool OriginAllowed(std::string_view origin, std::string_view host);

struct PageFile {
  std::string type;  // MIME
  std::string body;
};

// The built page by request target: "/", "/assets/index.js". Read once, so that nothing but these
// can be asked for. Throws std::runtime_error when the folder holds no page.
std::map<std::string, PageFile> ReadPage(const std::filesystem::path& folder);

}  // namespace pangea::viewer
