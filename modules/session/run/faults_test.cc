#include "session/run/faults.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>

namespace pangea::session {
namespace {

using testing::ElementsAre;

TEST(FaultSchedule, KillsEachOnceInTheOrderOfTime) {
  FaultSchedule faults({{7, "fusion", "", 0}, {2, "uplink_1", "", 0}, {3, "", "agent_handler", 5}});
  EXPECT_THAT(faults.TakeKills(1), ElementsAre());
  EXPECT_THAT(faults.TakeKills(7), ElementsAre("uplink_1", "fusion"));
  EXPECT_THAT(faults.TakeKills(9), ElementsAre());
  EXPECT_EQ(faults.end_s(), 8);
}

TEST(FaultSchedule, WhatTheSessionDidNotReachIsNamed) {
  FaultSchedule faults({{7, "fusion", "", 0}, {2, "uplink_1", "", 0}, {9.5, "", "fusion", 5}});
  faults.TakeKills(2);
  EXPECT_THAT(faults.NotReached(), ElementsAre("kill fusion at 7 s", "disk_full fusion at 9.5 s"));
  faults.TakeKills(10);
  EXPECT_THAT(faults.NotReached(), ElementsAre());
}

TEST(FaultSchedule, ADiskIsFullForItsTime) {
  const FaultSchedule faults({{3, "", "agent_handler", 5}, {4, "fusion", "", 10}});
  EXPECT_THAT(faults.DisksFull(2.9), ElementsAre());
  EXPECT_THAT(faults.DisksFull(3), ElementsAre("agent_handler"));
  EXPECT_THAT(faults.DisksFull(8), ElementsAre());
  EXPECT_THAT(faults.DisksEverFull(), ElementsAre("agent_handler"));
}

TEST(FaultSchedule, ADisconnectedAgentIsWaitedFor) {
  FaultSchedule faults({{4, "", "", 20, 2}, {9, "fusion", "", 0, 0}});
  EXPECT_EQ(faults.end_s(), 24);
  EXPECT_THAT(faults.TakeKills(30), ElementsAre("fusion"));
  EXPECT_THAT(faults.DisksEverFull(), ElementsAre());
}

TEST(DiskFull, RefusesWritesAndHeals) {
  std::signal(SIGXFSZ, SIG_IGN);
  std::string path = testing::TempDir() + "disk_full_XXXXXX";
  const int fd = mkstemp(path.data());
  ASSERT_GE(fd, 0);
  ASSERT_TRUE(SetDiskFull(getpid(), true));
  const ssize_t refused = write(fd, "a", 1);
  ASSERT_TRUE(SetDiskFull(getpid(), false));
  EXPECT_EQ(refused, -1);
  EXPECT_EQ(write(fd, "a", 1), 1);
  close(fd);
  unlink(path.c_str());
}

}  // namespace
}  // namespace pangea::session
