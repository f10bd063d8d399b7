#pragma once

// What a session does to its processes on purpose, and when.
//
//   faults:
//     - {at: 12.5, kill: fusion}
//     - {at: 30, disk_full: agent_handler, seconds: 10}
//     - {at: 50, disconnect: 2, seconds: 10}
//
// kill: SIGKILL; what dies is started again, planned or not. disk_full: the process can make no
// file longer (RLIMIT_FSIZE; the error is EFBIG in place of a full disk's ENOSPC), which needs
// neither root nor a disk to fill. disconnect: nothing passes between the agent and the server, a
// partition of its link (link_emulator); the agent goes on, and its uplink sends what has waited.

#include <sys/types.h>

#include <cstdint>
#include <set>
#include <string>
#include <vector>

namespace pangea::session {

struct Fault {
  double at_s = 0;         // session time
  std::string kill;        // a process, as its log in logs/ is named; or
  std::string disk_full;   // a process
  double seconds = 10;     // how long the disk is full, or the agent cut off
  int32_t disconnect = 0;  // or an agent; 0: none
};

class FaultSchedule {
 public:
  explicit FaultSchedule(std::vector<Fault> faults);

  // The processes to kill now, each fault once.
  std::vector<std::string> TakeKills(double session_s);
  std::set<std::string> DisksFull(double session_s) const;
  // All of them: fault or not, whose disk is full at some time.
  std::set<std::string> DisksEverFull() const;
  // The session time at which the last fault is over; 0 without faults.
  double end_s() const;

 private:
  std::vector<Fault> faults_;  // in the order of time
  size_t next_ = 0;
};

// Whether the process' files can grow. False if that cannot be set (it has just ended).
bool SetDiskFull(pid_t pid, bool full);

}  // namespace pangea::session
