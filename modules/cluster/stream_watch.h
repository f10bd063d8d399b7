#pragma once

// When a reader of a stream asks NATS for its next message: after a client said that it stored
// something, and once in kLook_us, because what clients say may be lost. Asking 50 times a second
// took half of an idle site's CPU.

#include <algorithm>
#include <cstdint>

namespace pangea {

class StreamWatch {
 public:
  static constexpr int64_t kLook_us = 1'000'000;
  // Questions after what a client said: the node of NATS that answers may lag behind.
  static constexpr int kTries = 3;

  // A client has stored something.
  void NoteStored(int64_t now_utime) {
    tries_left_ = kTries;
    stored_utime_ = now_utime;
  }
  // How long a bridge waits for messages of its bus, before it looks whether something was stored.
  int longest_wait_ms(int64_t now_utime) const {
    return now_utime < stored_utime_ + kActive_us ? 20 : 100;
  }
  bool IsDue(int64_t now_utime) const { return tries_left_ > 0 || now_utime >= next_look_utime_; }
  // NATS had nothing more.
  void NoteEmpty(int64_t now_utime) {
    tries_left_ = std::max(tries_left_ - 1, 0);
    next_look_utime_ = now_utime + kLook_us;
  }

 private:
  static constexpr int64_t kActive_us = 5'000'000;

  int tries_left_ = 0;
  int64_t next_look_utime_ = 0;
  int64_t stored_utime_ = 0;  // when something was last stored
};

}  // namespace pangea
