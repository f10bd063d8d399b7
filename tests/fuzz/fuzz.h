#pragma once

// Common parts of the fuzz targets. A target is a function of bytes, in a file fuzz_<name>.cc. For
// any bytes, it must not crash, hang, leak or let memory grow, and accepted input must fulfil the
// checked promises (Require). Clang's libFuzzer drives each in a program of its own (scripts/fuzz);
// in every other build one program, replay_main.cc, runs any of them on its corpus.

#include <cstdint>
#include <deque>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "bus/bus.h"

namespace pangea::fuzz {

// Announces a target of the program: each file defines one such constant.
using TargetFunction = int (*)(const uint8_t* data, size_t size);
struct Target {
  Target(const std::string& name, TargetFunction function);
};
const std::map<std::string, TargetFunction>& Targets();

// Aborts the process if the promise does not hold, so that the fuzzer reports it.
void Require(bool holds, const char* promise);

// One message of an input that is a sequence of messages. Each is encoded as one byte (low four
// bits: the channel; high four bits: the time that passes before it), two bytes of length,
// little-endian, and the payload. A length beyond the end of the input is cut there.
struct Step {
  int channel = 0;
  int64_t wait_us = 0;  // 1 ms to 33 s
  std::vector<uint8_t> data;
};
std::vector<Step> Steps(Bytes input);
void AppendStep(int channel, Bytes data, std::vector<uint8_t>* sequence);

// A channel to which a target listens, and the fingerprint of its LCM type; empty for other
// contents.
struct Channel {
  std::string name;
  std::optional<int64_t> fingerprint;
};
template <typename Message>
Channel ChannelOf(const std::string& name) {
  return {name, Message::getHash()};
}
// Index of the channel in the table; -1 if it is not there.
int Find(const std::vector<Channel>& table, const std::string& channel);

// Overwrites the first eight bytes: with a wrong fingerprint decoding fails at once, which would
// waste nearly all inputs.
void SetFingerprint(int64_t fingerprint, std::vector<uint8_t>* payload);

// Like LocalBus, but many times faster: the only regular expressions it knows are "[0-9]+" at the
// end, and ".*".
class QuickBus : public Bus {
 public:
  void Publish(const std::string& channel, Bytes data) override;
  void Subscribe(const std::string& channel_regex, Handler handler) override;
  void Drain();

 private:
  struct Subscription {
    std::string prefix;
    bool whole = true;  // the prefix must be the whole channel name
    Handler handler;
  };
  struct Message {
    std::string channel;
    std::vector<uint8_t> data;
  };
  std::deque<Subscription> subscriptions_;
  std::deque<Message> messages_;
};

// Plays a sequence of messages to the processes on a bus.
void Play(Bytes input, const std::vector<Channel>& table, QuickBus* bus,
          const std::function<void(int64_t wait_us)>& poll);

// A folder only of this process, in memory if possible; removed at the end.
const std::filesystem::path& ScratchFolder();
void WriteFile(const std::filesystem::path& file, Bytes bytes);

}  // namespace pangea::fuzz
