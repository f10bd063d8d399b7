#include "bus/record_status.h"

#include <gtest/gtest.h>

#include "core/testing/test_record_store.h"

namespace pangea {
namespace {

TEST(RecordStatus, SaysWhatStaysInMemoryAndWhy) {
  LocalBus bus;
  Node node(bus, "some");
  test::TestRecordStore records(0);
  EXPECT_EQ(NoteRecords({.in_memory = 5}, nullptr, &node), "");
  EXPECT_EQ(NoteRecords({}, &records, &node), "");
  EXPECT_FALSE(CounterOf(node.Status(0, 0, ""), "keyframes_in_memory"));

  EXPECT_FALSE(records.Append({}));
  EXPECT_EQ(NoteRecords({.in_memory = 5, .dropped = 2}, &records, &node),
            "; 5 keyframes in memory, 2 dropped: no room");
  const status_t status = node.Status(0, 0, "");
  EXPECT_EQ(CounterOf(status, "keyframes_in_memory"), 5);
  EXPECT_EQ(CounterOf(status, "keyframes_dropped"), 2);
  EXPECT_FALSE(CounterOf(status, "keyframes_unreadable"));
}

}  // namespace
}  // namespace pangea
