#pragma once

// How often somebody may be wrong: kBurst times at once from one address, then once in
// kInterval_us. Bounded: kMaxAddresses; while more were wrong of late, no further one may try.

#include <cstdint>
#include <map>
#include <string>

namespace pangea {

class AttemptLimit {
 public:
  static constexpr int kBurst = 10;
  static constexpr int64_t kInterval_us = 6'000'000;
  static constexpr size_t kMaxAddresses = 1000;

  // `now_us`: a clock that never steps.
  bool MayTry(const std::string& address, int64_t now_us);
  void NoteWrong(const std::string& address, int64_t now_us);

 private:
  // When the last of its wrong attempts is forgotten; each takes kInterval_us.
  std::map<std::string, int64_t> forgotten_us_;
};

}  // namespace pangea
