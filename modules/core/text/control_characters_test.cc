#include "core/text/control_characters.h"

#include <gtest/gtest.h>

namespace pangea {
namespace {

TEST(Text, ControlCharactersAreFound) {
  for (const char* text : {"a\nb", "\x1b[2J", "\x7f", "\xc2\x80", "caf\xc2\x9b", "\xc2\x9f"}) {
    EXPECT_TRUE(HasControlCharacter(text)) << text;
  }
  EXPECT_TRUE(HasControlCharacter(std::string_view("a\0", 2)));
}

TEST(Text, OtherCharactersAreNone) {
  for (const char* text : {"", "kettle", "\xc2\xa0", "caf\xc3\xa9", "\xc3\x80", "\xe5\x90\x8d"}) {
    EXPECT_FALSE(HasControlCharacter(text)) << text;
  }
}

}  // namespace
}  // namespace pangea
