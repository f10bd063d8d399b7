#include "viewer/web/web_rules.h"

#include <arpa/inet.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdint>
#include <fstream>
#include <iterator>
#include <stdexcept>

namespace pangea::viewer {
namespace {

namespace fs = std::filesystem;

bool IsAddress(const std::string& text) {
  std::array<unsigned char, sizeof(in6_addr)> address{};
  if (text.size() > 2 && text.front() == '[' && text.back() == ']') {
    return inet_pton(AF_INET6, text.substr(1, text.size() - 2).c_str(), address.data()) == 1;
  }
  return inet_pton(AF_INET, text.c_str(), address.data()) == 1;
}

bool IsPort(std::string_view text) {
  uint16_t port = 0;
  const char* const end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, port);
  return error == std::errc() && stop == end && port > 0;
}

std::string TypeOf(const fs::path& file) {
  static const std::map<std::string, std::string> kTypes = {
      {".html", "text/html; charset=utf-8"},
      {".js", "text/javascript; charset=utf-8"},
      {".css", "text/css; charset=utf-8"},
      {".svg", "image/svg+xml"},
      {".png", "image/png"},
      {".woff2", "font/woff2"}};
  const auto type = kTypes.find(file.extension().string());
  return type == kTypes.end() ? "application/octet-stream" : type->second;
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
  return name == "localhost" || IsAddress(name) ||
         std::find(names.begin(), names.end(), name) != names.end();
}

bool OriginAllowed(std::string_view origin, std::string_view host) {
  return !host.empty() &&
         (origin == fmt::format("http://{}", host) || origin == fmt::format("https://{}", host));
}

std::map<std::string, PageFile> ReadPage(const fs::path& folder) {
  if (!fs::is_regular_file(folder / "index.html")) {
    throw std::runtime_error(fmt::format(
        "there is no page in {}: scripts/viewer builds it (with npm), or give --page FOLDER",
        folder.string()));
  }
  std::map<std::string, PageFile> page;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder)) {
    if (entry.is_regular_file()) {
      std::ifstream in(entry.path(), std::ios::binary);
      page[fmt::format("/{}", fs::relative(entry.path(), folder).generic_string())] = {
          TypeOf(entry.path()), std::string(std::istreambuf_iterator<char>(in), {})};
    }
  }
  page["/"] = page["/index.html"];
  return page;
}

}  // namespace pangea::viewer
