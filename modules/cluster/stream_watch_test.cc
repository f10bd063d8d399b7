#include "cluster/stream_watch.h"

#include <gtest/gtest.h>

namespace pangea {
namespace {

TEST(StreamWatch, AsksOnceASecondAndAfterSomethingWasStored) {
  constexpr int64_t kNow = 1'000'000'000;
  StreamWatch watch;
  EXPECT_TRUE(watch.IsDue(kNow)) << "at the start nothing is known";
  watch.NoteEmpty(kNow);
  EXPECT_FALSE(watch.IsDue(kNow + StreamWatch::kLook_us - 1));
  EXPECT_TRUE(watch.IsDue(kNow + StreamWatch::kLook_us));
  EXPECT_EQ(watch.longest_wait_ms(kNow), 100);
  watch.NoteStored(kNow);
  EXPECT_EQ(watch.longest_wait_ms(kNow), 20);
  for (int i = 0; i < StreamWatch::kTries; ++i) {
    EXPECT_TRUE(watch.IsDue(kNow)) << "the node that answers may lag behind";
    watch.NoteEmpty(kNow);
  }
  EXPECT_FALSE(watch.IsDue(kNow));
}

}  // namespace
}  // namespace pangea
