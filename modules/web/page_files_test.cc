#include "web/page_files.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <stdexcept>

namespace pangea::web {
namespace {

using testing::Contains;
using testing::HasSubstr;
using testing::Not;
using testing::Pair;

std::filesystem::path MakePage() {
  std::filesystem::path folder = testing::TempDir() + "/page_files";
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder / "assets");
  std::ofstream(folder / "index.html") << "<p>";
  std::ofstream(folder / "assets" / "a.js") << "1";
  std::ofstream(folder / "assets" / "a.js.gz") << "compressed";
  std::ofstream(folder / "vio.wasm") << "2";
  std::ofstream(folder / "lone.gz") << "3";
  return folder;
}

TEST(PageFiles, APageIsReadOnceAndNothingElse) {
  const auto folder = MakePage();
  const Page page = ReadPage(folder, "build it");
  std::ofstream(folder / "late.html") << "late";
  EXPECT_EQ(*page.at("/").body, "<p>");
  EXPECT_EQ(page.at("/assets/a.js").type, "text/javascript; charset=utf-8");
  EXPECT_EQ(page.at("/vio.wasm").type, "application/wasm");
  EXPECT_EQ(page.at("/lone.gz").type, "application/octet-stream");
  EXPECT_EQ(page.size(), 5U);
  EXPECT_EQ(AnswerFile(page, {"GET", "/late.html", "", "", ""}, "").status, 404);
  EXPECT_EQ(AnswerFile(page, {"POST", "/", "", "", ""}, "").status, 405);
}

TEST(PageFiles, WhatOthersAppendToALinkIsIgnored) {
  const Page page = ReadPage(MakePage(), "");
  for (const char* target : {"/?v=2", "/?", "/index.html?utm_source=qr&a=/b?c"}) {
    const WebAnswer answer = AnswerFile(page, {"GET", target, "", "", ""}, "");
    EXPECT_EQ(answer.status, 200) << target;
    EXPECT_EQ(answer.file ? *answer.file : "", "<p>") << target;
  }
  EXPECT_EQ(AnswerFile(page, {"GET", "/late.html?v=2", "", "", ""}, "").status, 404);
}

TEST(PageFiles, SaysHowToMakeAPageThatIsNotThere) {
  try {
    ReadPage(MakePage() / "assets", "build it");
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), HasSubstr("page_files/assets: build it"));
  }
}

TEST(PageFiles, ACompressedCopyIsForThoseWhoTakeIt) {
  const Page page = ReadPage(MakePage(), "");
  WebRequest request{"GET", "/assets/a.js", "", "", ""};
  WebAnswer answer = AnswerFile(page, request, "default-src 'self'");
  EXPECT_EQ(*answer.file, "1");
  EXPECT_THAT(answer.headers, Not(Contains(Pair("Content-Encoding", "gzip"))));
  request.takes_gzip = true;
  answer = AnswerFile(page, request, "default-src 'self'");
  EXPECT_EQ(*answer.file, "compressed");
  EXPECT_EQ(answer.type, "text/javascript; charset=utf-8");
  EXPECT_THAT(answer.headers, Contains(Pair("Content-Encoding", "gzip")));
  EXPECT_THAT(answer.headers, Contains(Pair("Vary", "Accept-Encoding")));
  EXPECT_THAT(answer.headers, Contains(Pair("Content-Security-Policy", "default-src 'self'")));
  request.target = "/";
  EXPECT_EQ(*AnswerFile(page, request, "").file, "<p>");
}

}  // namespace
}  // namespace pangea::web
