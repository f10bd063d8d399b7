#include "tags/tag_file.h"

#include <gtest/gtest.h>

#include <fstream>

namespace pangea {
namespace {

class TagFileTest : public testing::Test {
 protected:
  std::filesystem::path Written(const std::string& text) {
    const auto* const info = testing::UnitTest::GetInstance()->current_test_info();
    const auto file =
        std::filesystem::path(testing::TempDir()) / (std::string(info->name()) + ".yaml");
    std::ofstream(file) << text;
    return file;
  }

  std::string Refused(const std::string& text) {
    try {
      ReadTagFile(Written(text));
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return "";
  }
};

TEST_F(TagFileTest, SizesByTag) {
  const TagSizes sizes(ReadTagFile(Written(
      "tags:\n- {ids: 0-3, size_m: 0.16}\n- {family: 36h11, ids: '20, 22 - 23', size_m: 0.4}\n")));
  EXPECT_EQ(sizes.all().size(), 7u);
  EXPECT_EQ(sizes.Of({TagFamily::k36h11, 3}), 0.16);
  EXPECT_EQ(sizes.Of({TagFamily::k36h11, 22}), 0.4);
  EXPECT_FALSE(sizes.Of({TagFamily::k36h11, 21}));
}

// Each message has the file, the field, and what to do.
TEST_F(TagFileTest, WhatIsWrongIsRefused) {
  const std::pair<std::string, std::vector<std::string>> cases[] = {
      {"tags:\n- {ids: 0-3, size_m: 0.16}\n- {ids: 3, size_m: 0.2}\n",
       {".yaml", "tags[1].ids", "3 is there twice", "print each tag once"}},
      {"tags:\n- {ids: 0-3, size_m: 0}\n", {".yaml", "tags[0].size_m", "0.005"}},
      {"tags:\n- {ids: 0-3, size_m: 160}\n", {".yaml", "tags[0].size_m", "5"}},
      {"tags:\n- {family: 25h9, ids: 0-3, size_m: 0.16}\n",
       {".yaml", "tags[0].family", "25h9", "36h11"}},
      {"tags:\n- {ids: 0-600, size_m: 0.16}\n", {"tags[0].ids", "600", "0 to 586"}},
      {"tags:\n- {ids: a-b, size_m: 0.16}\n", {"tags[0].ids", "a-b", "0-19"}},
      {"tags:\n- {ids: 5-3, size_m: 0.16}\n", {"tags[0].ids", "5-3"}},
      {"tags:\n- {ids: '', size_m: 0.16}\n", {"tags[0].ids"}},
      {"tags:\n- {ids: 1}\n", {".yaml", "size_m"}},
      {"tags:\n- {ids: 1, size: 0.16}\n", {".yaml", "size", "size_m"}},
      {"sizes: []\n", {".yaml", "sizes", "tags"}},
      {"", {".yaml", "tags"}},
  };
  for (const auto& [text, parts] : cases) {
    const std::string refused = Refused(text);
    for (const std::string& part : parts) {
      EXPECT_NE(refused.find(part), std::string::npos) << text << "→ " << refused;
    }
  }
}

}  // namespace
}  // namespace pangea
