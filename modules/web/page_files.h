#pragma once

// The files of a built web page in memory. They are read once, so that no other file can be asked
// for.

#include <filesystem>
#include <map>
#include <memory>
#include <string>

#include "web/web_site.h"

namespace pangea::web {

struct PageFile {
  std::string type;  // MIME
  std::shared_ptr<const std::string> body;
  std::shared_ptr<const std::string> gzip;  // content of <name>.gz; null if there is none
};

// Files by request target, such as "/assets/index.js"; "/" is "/index.html".
using Page = std::map<std::string, PageFile>;

// Throws std::runtime_error when the folder has no page; the message ends with the advice `mend`.
Page ReadPage(const std::filesystem::path& folder, const std::string& mend);

// Answers a GET with the file, with `policy` as its Content-Security-Policy; else with 404 or 405.
// What follows a "?" is ignored: readers of QR codes and messengers append to links.
WebAnswer AnswerFile(const Page& page, const WebRequest& request, const std::string& policy);

}  // namespace pangea::web
