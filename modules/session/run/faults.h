#pragma once

// The faults that a session causes on purpose, and their times.
//
//   faults:
//     - {at: 12.5, kill: fusion}
//     - {at: 30, disk_full: agent_handler, seconds: 10}
//     - {at: 50, disconnect: 2, seconds: 10}
//
// kill: SIGKILL; any process that ends is restarted, planned or not. disk_full: the process cannot
// make a file longer (RLIMIT_FSIZE; the error is EFBIG instead of a full disk's ENOSPC), which
// needs neither root nor a disk to fill. disconnect: nothing passes between the agent and the
// server (a partition in link_emulator); the agent continues, and later its uplink sends what has
// waited.

#include <sys/types.h>

#include <cstdint>
#include <set>
#include <string>
#include <vector>

namespace pangea::session {

struct Fault {
  double at_s = 0;         // session time
  std::string kill;        // a process, named like its log in logs/; or
  std::string disk_full;   // a process
  double seconds = 10;     // duration of disk_full or disconnect
  int32_t disconnect = 0;  // or an agent; 0: none
};

class FaultSchedule {
 public:
  explicit FaultSchedule(std::vector<Fault> faults);

  // The processes to kill now; each fault is returned once.
  std::vector<std::string> TakeKills(double session_s);
  std::set<std::string> DisksFull(double session_s) const;
  // All processes whose disk is full at some time.
  std::set<std::string> DisksEverFull() const;
  // What has not come by the time of the last TakeKills, for people: "kill fusion at 12.5 s".
  std::vector<std::string> NotReached() const;
  // Session time of the end of the last fault; 0 without faults.
  double end_s() const;

 private:
  std::vector<Fault> faults_;  // in time order
  size_t next_ = 0;
};

// Sets whether the process' files can grow. False if that fails (the process has just ended).
bool SetDiskFull(pid_t pid, bool full);

}  // namespace pangea::session
