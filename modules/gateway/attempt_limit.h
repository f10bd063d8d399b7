#pragma once

// Limits wrong attempts: kBurst at once from one address, then one per kInterval_us. Bounded: while
// kMaxAddresses had wrong attempts recently, no further address may try.

#include <cstdint>
#include <map>
#include <string>

namespace pangea {

class AttemptLimit {
 public:
  static constexpr int kBurst = 10;
  static constexpr int64_t kInterval_us = 6'000'000;
  static constexpr size_t kMaxAddresses = 1000;

  // `now_us`: monotonic clock.
  bool MayTry(const std::string& address, int64_t now_us);
  void NoteWrong(const std::string& address, int64_t now_us);

 private:
  // By address, when its last wrong attempt is forgotten; each wrong attempt adds kInterval_us.
  std::map<std::string, int64_t> forgotten_us_;
};

}  // namespace pangea
