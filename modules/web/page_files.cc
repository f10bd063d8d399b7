#include "web/page_files.h"

#include <fmt/format.h>

#include <fstream>
#include <iterator>
#include <stdexcept>

namespace pangea::web {
namespace {

namespace fs = std::filesystem;

std::string TypeOf(const fs::path& file) {
  static const std::map<std::string, std::string> kTypes = {
      {".html", "text/html; charset=utf-8"},
      {".js", "text/javascript; charset=utf-8"},
      {".mjs", "text/javascript; charset=utf-8"},
      {".css", "text/css; charset=utf-8"},
      {".json", "application/json"},
      {".webmanifest", "application/manifest+json"},
      {".wasm", "application/wasm"},
      {".svg", "image/svg+xml"},
      {".png", "image/png"},
      {".woff2", "font/woff2"}};
  const auto type = kTypes.find(file.extension().string());
  return type == kTypes.end() ? "application/octet-stream" : type->second;
}

std::shared_ptr<const std::string> ReadFile(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return std::make_shared<const std::string>(std::istreambuf_iterator<char>(in),
                                             std::istreambuf_iterator<char>());
}

// Whether the file is for example "index.js.gz" and there is also an index.js.
bool IsCompressedCopy(const fs::path& file) {
  return file.extension() == ".gz" && fs::is_regular_file(fs::path(file).replace_extension());
}

}  // namespace

Page ReadPage(const fs::path& folder, const std::string& mend) {
  if (!fs::is_regular_file(folder / "index.html")) {
    throw std::runtime_error(fmt::format("there is no page in {}: {}", folder.string(), mend));
  }
  Page page;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder)) {
    const fs::path& file = entry.path();
    if (!entry.is_regular_file() || IsCompressedCopy(file)) {
      continue;
    }
    PageFile& read = page[fmt::format("/{}", fs::relative(file, folder).generic_string())];
    read = {TypeOf(file), ReadFile(file), nullptr};
    if (const fs::path copy = file.string() + ".gz"; fs::is_regular_file(copy)) {
      read.gzip = ReadFile(copy);
    }
  }
  page["/"] = page["/index.html"];
  return page;
}

WebAnswer AnswerFile(const Page& page, const WebRequest& request, const std::string& policy) {
  if (request.method != "GET") {
    return {405, "text/plain; charset=utf-8", "Only GET and HEAD.\n"};
  }
  const auto found = page.find(request.target.substr(0, request.target.find('?')));
  if (found == page.end()) {
    return {404, "text/plain; charset=utf-8", "There is no such file.\n"};
  }
  const PageFile& file = found->second;
  WebAnswer answer{200, file.type, "", {{"Content-Security-Policy", policy}}, file.body};
  if (file.gzip) {
    answer.headers.emplace_back("Vary", "Accept-Encoding");
    if (request.takes_gzip) {
      answer.headers.emplace_back("Content-Encoding", "gzip");
      answer.file = file.gzip;
    }
  }
  return answer;
}

}  // namespace pangea::web
