#pragma once

// The web site of the viewer: the page, and the connection to each browser that shows it.

#include "viewer/show.h"
#include "web/page_files.h"
#include "web/web_site.h"

namespace pangea::viewer {

class PageSite : public web::WebSite {
 public:
  // `show` must outlive the site.
  PageSite(web::Page page, Show& show) : page_(std::move(page)), show_(show) {}

  void Answer(const web::WebRequest& request, Reply reply) override;
  std::unique_ptr<web::WebPeer> Open(const web::WebRequest& request) override;

 private:
  const web::Page page_;
  Show& show_;
};

}  // namespace pangea::viewer
