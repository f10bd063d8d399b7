#pragma once

// How long a process waits for messages that did not come, and how often it asks for them. All of
// it in one place: who asks and who answers must agree.

#include <cstdint>

namespace pangea::timeouts {

inline constexpr int64_t kSecond_us = 1'000'000;

// A gap may close by itself for so long: messages of two senders overtake each other.
inline constexpr int64_t kGapWait_us = kSecond_us / 2;
// An unanswered request is repeated; what comes meanwhile puts it off.
inline constexpr int64_t kRequestInterval_us = kSecond_us;
// A stream that must go on does so after this many requests that brought nothing.
inline constexpr int kMaxRequests = 15;
// One request's answers must fit a receive buffer: 50 keyframes are about 1.4 MB. Small messages
// may be more.
inline constexpr int32_t kMaxAsked = 50;
inline constexpr int32_t kMaxSmallAsked = 500;

// Half a minute for the states: a pose graph that started with us has caught up by then.
inline constexpr int64_t kStateInterval_us = 2 * kSecond_us;
inline constexpr int kMaxStateRequests = 15;

// A process that came late works with what it has when so long nothing more of the journal came.
inline constexpr int64_t kCatchUpSilence_us = 5 * kSecond_us;

// A promised verification result is asked for after this time, then ever more rarely.
inline constexpr int64_t kResultWait_us = 2 * kSecond_us;
inline constexpr int64_t kMaxResultWait_us = 60 * kSecond_us;

}  // namespace pangea::timeouts
