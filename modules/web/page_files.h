#pragma once

// A built web page as files in memory, read once, so that nothing but these can be asked for.

#include <filesystem>
#include <map>
#include <memory>
#include <string>

#include "web/web_site.h"

namespace pangea::web {

struct PageFile {
  std::string type;  // MIME
  std::shared_ptr<const std::string> body;
  std::shared_ptr<const std::string> gzip;  // the same as <name>.gz, where the folder has that
};

// By request target: "/", which is "/index.html", "/assets/index.js".
using Page = std::map<std::string, PageFile>;

// Throws std::runtime_error, which ends with `mend`, when the folder holds no page.
Page ReadPage(const std::filesystem::path& folder, const std::string& mend);

// The file that a GET asks for, with this policy for what it may load and do; 404, 405 else.
WebAnswer AnswerFile(const Page& page, const WebRequest& request, const std::string& policy);

}  // namespace pangea::web
