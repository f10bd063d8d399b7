#pragma once

// The page, and the conversation with each browser that shows it, as a site.

#include <filesystem>
#include <map>
#include <string>

#include "viewer/show.h"
#include "web/web_site.h"

namespace pangea::viewer {

struct PageFile {
  std::string type;  // MIME
  std::string body;
};

// The built page by request target: "/", "/assets/index.js". Read once, so that nothing but these
// can be asked for. Throws std::runtime_error when the folder holds no page.
std::map<std::string, PageFile> ReadPage(const std::filesystem::path& folder);

class PageSite : public web::WebSite {
 public:
  // `show` outlives it.
  PageSite(std::map<std::string, PageFile> page, Show& show)
      : page_(std::move(page)), show_(show) {}

  void Answer(const web::WebRequest& request, Reply reply) override;
  std::unique_ptr<web::WebPeer> Open(const web::WebRequest& request) override;

 private:
  const std::map<std::string, PageFile> page_;
  Show& show_;
};

}  // namespace pangea::viewer
