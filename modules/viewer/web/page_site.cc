#include "viewer/web/page_site.h"

#include <fmt/format.h>

#include <fstream>
#include <iterator>
#include <stdexcept>

#include "viewer/web/page_link.h"

namespace pangea::viewer {
namespace {

namespace fs = std::filesystem;

// What a page may load and do; `host` is one that HostAllowed has let through.
std::string PagePolicy(const std::string& host) {
  return fmt::format(
      "default-src 'self'; connect-src 'self' ws://{0} wss://{0}; img-src 'self' blob: data:; "
      "style-src 'self' 'unsafe-inline'; frame-ancestors 'none'",
      host);
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

web::WebAnswer Refusal(int status, const std::string& why) {
  return {status, "text/plain; charset=utf-8", why};
}

}  // namespace

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

void PageSite::Answer(const web::WebRequest& request, Reply reply) {
  if (request.method != "GET") {
    return reply(Refusal(405, "Only GET and HEAD.\n"));
  }
  const auto file = page_.find(request.target);
  if (file == page_.end()) {
    return reply(Refusal(404, "There is no such file.\n"));
  }
  reply({200,
         file->second.type,
         file->second.body,
         {{"Content-Security-Policy", PagePolicy(request.host)}}});
}

std::unique_ptr<web::WebPeer> PageSite::Open(const web::WebRequest&) {
  return std::make_unique<PageLink>(show_);
}

}  // namespace pangea::viewer
