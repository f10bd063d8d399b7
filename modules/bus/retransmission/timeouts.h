#pragma once

// How long a process waits for missing messages, and how often it asks for them. They are all here,
// because requesters and answerers must agree.

#include <cstdint>

namespace pangea::timeouts {

inline constexpr int64_t kSecond_us = 1'000'000;

// A gap has this time to close by itself, because messages of two senders can overtake each other.
inline constexpr int64_t kGapWait_us = kSecond_us / 2;
// An unanswered request is repeated after this time; each answer that comes restarts the time.
inline constexpr int64_t kRequestInterval_us = kSecond_us;
// A stream that may skip items skips them after this many requests without answer.
inline constexpr int kMaxRequests = 15;
// Messages per request. The answers to one request must fit a receive buffer: 50 keyframes are
// about 1.4 MB. More small messages fit.
inline constexpr int32_t kMaxAsked = 50;
inline constexpr int32_t kMaxSmallAsked = 500;

// States are asked for during half a minute; a pose graph that started together with this process
// has caught up by then.
inline constexpr int64_t kStateInterval_us = 2 * kSecond_us;
inline constexpr int kMaxStateRequests = 15;

// A process that started late ends its catch-up after this time without progress.
inline constexpr int64_t kCatchUpSilence_us = 5 * kSecond_us;

// An expected verification result is asked for after kResultWait_us, then ever more rarely, but at
// least every kMaxResultWait_us.
inline constexpr int64_t kResultWait_us = 2 * kSecond_us;
inline constexpr int64_t kMaxResultWait_us = 60 * kSecond_us;

}  // namespace pangea::timeouts
