#include "session/run/faults.h"

#include <fmt/format.h>
#include <sys/resource.h>

#include <algorithm>

namespace pangea::session {

FaultSchedule::FaultSchedule(std::vector<Fault> faults) : faults_(std::move(faults)) {
  std::ranges::stable_sort(faults_, {}, &Fault::at_s);
}

std::vector<std::string> FaultSchedule::TakeKills(double session_s) {
  std::vector<std::string> kills;
  for (; next_ < faults_.size() && faults_[next_].at_s <= session_s; ++next_) {
    if (!faults_[next_].kill.empty()) {
      kills.push_back(faults_[next_].kill);
    }
  }
  return kills;
}

std::set<std::string> FaultSchedule::DisksFull(double session_s) const {
  std::set<std::string> full;
  for (const Fault& fault : faults_) {
    if (fault.at_s <= session_s && session_s < fault.at_s + fault.seconds) {
      full.insert(fault.disk_full);
    }
  }
  full.erase("");
  return full;
}

std::set<std::string> FaultSchedule::DisksEverFull() const {
  std::set<std::string> full;
  for (const Fault& fault : faults_) {
    full.insert(fault.disk_full);
  }
  full.erase("");
  return full;
}

std::vector<std::string> FaultSchedule::NotReached() const {
  std::vector<std::string> left;
  for (size_t i = next_; i < faults_.size(); ++i) {
    const Fault& fault = faults_[i];
    if (!fault.kill.empty() || !fault.disk_full.empty()) {
      left.push_back(fault.kill.empty()
                         ? fmt::format("disk_full {} at {:g} s", fault.disk_full, fault.at_s)
                         : fmt::format("kill {} at {:g} s", fault.kill, fault.at_s));
    }
  }
  return left;
}

double FaultSchedule::end_s() const {
  double end = 0;
  for (const Fault& fault : faults_) {
    end = std::max(end, fault.at_s + (fault.kill.empty() ? fault.seconds : 0));
  }
  return end;
}

bool SetDiskFull(pid_t pid, bool full) {
  rlimit limit{};
  if (prlimit(pid, RLIMIT_FSIZE, nullptr, &limit) != 0) {
    return false;
  }
  limit.rlim_cur = full ? 0 : limit.rlim_max;
  return prlimit(pid, RLIMIT_FSIZE, &limit, nullptr) == 0;
}

}  // namespace pangea::session
