#include "tags/tag_sheet.h"

#include <gtest/gtest.h>

#include "tags/tag_pattern.h"

namespace pangea {
namespace {

TEST(TagPattern, ABlackSquareInAWhiteBorder) {
  const TagPattern pattern = PatternOf({TagFamily::k36h11, 17});
  ASSERT_EQ(pattern.cells, 10);
  EXPECT_EQ(pattern.square_cells, 8);
  for (int i = 0; i < 10; ++i) {
    EXPECT_TRUE(pattern.IsWhite(0, i));
    EXPECT_TRUE(pattern.IsWhite(i, 9));
    EXPECT_EQ(pattern.IsWhite(1, i), i == 0 || i == 9);
    EXPECT_EQ(pattern.IsWhite(i, 8), i == 0 || i == 9);
  }
  EXPECT_NE(pattern.white, PatternOf({TagFamily::k36h11, 18}).white);
}

TEST(TagSheet, HasTheTagInItsSize) {
  const std::string svg = TagSheet({TagFamily::k36h11, 17}, 120);
  EXPECT_NE(svg.find("width='210mm' height='297mm'"), std::string::npos);
  EXPECT_NE(svg.find("36h11:17"), std::string::npos);
  // The uppermost row of the black square.
  EXPECT_NE(svg.find("<rect x='45.0000' y='35.0000' width='120.0000' height='15.0000'/>"),
            std::string::npos);
}

}  // namespace
}  // namespace pangea
