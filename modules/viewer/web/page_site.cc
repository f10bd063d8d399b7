#include "viewer/web/page_site.h"

#include <fmt/format.h>

#include "viewer/web/page_link.h"

namespace pangea::viewer {
namespace {

// The page's Content-Security-Policy; HostAllowed has accepted `host`.
std::string PagePolicy(const std::string& host) {
  return fmt::format(
      "default-src 'self'; connect-src 'self' ws://{0} wss://{0}; img-src 'self' blob: data:; "
      "style-src 'self' 'unsafe-inline'; frame-ancestors 'none'",
      host);
}

}  // namespace

void PageSite::Answer(const web::WebRequest& request, Reply reply) {
  reply(web::AnswerFile(page_, request, PagePolicy(request.host)));
}

std::unique_ptr<web::WebPeer> PageSite::Open(const web::WebRequest&) {
  return std::make_unique<PageLink>(show_);
}

}  // namespace pangea::viewer
