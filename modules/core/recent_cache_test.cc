#include "core/recent_cache.h"

#include <gtest/gtest.h>

namespace pangea {
namespace {

TEST(RecentCache, TheOneUnusedForLongestMakesRoom) {
  RecentCache<int, int> cache(2);
  cache.Add(1, std::make_shared<const int>(10));
  cache.Add(2, std::make_shared<const int>(20));
  EXPECT_EQ(*cache.Find(1), 10);
  cache.Add(3, std::make_shared<const int>(30));
  EXPECT_EQ(cache.Find(2), nullptr);
  EXPECT_EQ(*cache.Find(1), 10);
  EXPECT_EQ(*cache.Find(3), 30);
  cache.Erase(1);
  cache.Erase(7);
  EXPECT_EQ(cache.Find(1), nullptr);
  cache.Add(1, std::make_shared<const int>(11));
  EXPECT_EQ(*cache.Find(1), 11);
  EXPECT_EQ(*cache.Find(3), 30);
}

}  // namespace
}  // namespace pangea
