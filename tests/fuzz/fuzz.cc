#include "fuzz.h"

#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <fstream>

namespace pangea::fuzz {
namespace {

namespace fs = std::filesystem;

class Folder {
 public:
  Folder() {
    const fs::path memory = "/dev/shm";
    path_ = (fs::is_directory(memory) ? memory : fs::temp_directory_path()) /
            ("pangea_fuzz_" + std::to_string(getpid()));
    fs::create_directories(path_);
  }
  ~Folder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

// A function's static is there before the first target announces itself.
std::map<std::string, TargetFunction>& MutableTargets() {
  static std::map<std::string, TargetFunction> targets;
  return targets;
}

}  // namespace

Target::Target(const std::string& name, TargetFunction function) {
  MutableTargets()[name] = function;
}

const std::map<std::string, TargetFunction>& Targets() { return MutableTargets(); }

void Require(bool holds, const char* promise) {
  if (!holds) {
    std::fprintf(stderr, "broken promise: %s\n", promise);
    std::abort();
  }
}

std::vector<Step> Steps(Bytes input) {
  std::vector<Step> steps;
  while (input.size() >= 3) {
    Step step;
    step.channel = input[0] & 15;
    step.wait_us = int64_t{1000} << (input[0] >> 4);
    const size_t wanted = input[1] | static_cast<size_t>(input[2]) << 8;
    input = input.subspan(3);
    const Bytes data = input.first(std::min(wanted, input.size()));
    step.data.assign(data.begin(), data.end());
    input = input.subspan(data.size());
    steps.push_back(std::move(step));
  }
  return steps;
}

void AppendStep(int channel, Bytes data, std::vector<uint8_t>* sequence) {
  sequence->push_back(static_cast<uint8_t>(channel));
  sequence->push_back(static_cast<uint8_t>(data.size() & 255));
  sequence->push_back(static_cast<uint8_t>(data.size() >> 8));
  sequence->insert(sequence->end(), data.begin(), data.end());
}

int Find(const std::vector<Channel>& table, const std::string& channel) {
  const auto it = std::find_if(table.begin(), table.end(),
                               [&](const Channel& known) { return known.name == channel; });
  return it == table.end() ? -1 : static_cast<int>(it - table.begin());
}

void SetFingerprint(int64_t fingerprint, std::vector<uint8_t>* payload) {
  for (size_t i = 0; i < std::min<size_t>(8, payload->size()); ++i) {
    (*payload)[i] = static_cast<uint8_t>(static_cast<uint64_t>(fingerprint) >> (56 - 8 * i));
  }
}

void QuickBus::Publish(const std::string& channel, Bytes data) {
  messages_.push_back({channel, {data.begin(), data.end()}});
}

void QuickBus::Subscribe(const std::string& channel_regex, Handler handler) {
  const size_t special = channel_regex.find_first_of("[.");
  subscriptions_.push_back(
      {channel_regex.substr(0, special), special == std::string::npos, std::move(handler)});
}

void QuickBus::Drain() {
  for (; !messages_.empty(); messages_.pop_front()) {
    const Message message = std::move(messages_.front());
    for (size_t i = 0; i < subscriptions_.size(); ++i) {
      const Subscription& subscription = subscriptions_[i];
      if (subscription.whole ? message.channel == subscription.prefix
                             : message.channel.starts_with(subscription.prefix)) {
        subscription.handler(message.channel, message.data);
      }
    }
  }
}

void Play(Bytes input, const std::vector<Channel>& table, QuickBus* bus,
          const std::function<void(int64_t wait_us)>& poll) {
  constexpr size_t kMaxSteps = 100;  // more steps would only be slow
  std::vector<Step> steps = Steps(input);
  steps.resize(std::min(steps.size(), kMaxSteps));
  for (Step& step : steps) {
    const Channel& channel = table[static_cast<size_t>(step.channel) % table.size()];
    if (channel.fingerprint) {
      SetFingerprint(*channel.fingerprint, &step.data);
    }
    poll(step.wait_us);
    bus->Publish(channel.name, step.data);
    bus->Drain();
  }
  for (int i = 0; i < 3; ++i) {
    poll(1'000'000);
    bus->Drain();
  }
}

const fs::path& ScratchFolder() {
  static const Folder folder;
  return folder.path();
}

void WriteFile(const fs::path& file, Bytes bytes) {
  std::ofstream stream(file, std::ios::binary);
  stream.write(reinterpret_cast<const char*>(bytes.data()),
               static_cast<std::streamsize>(bytes.size()));
  stream.close();
  Require(stream.good(), "the scratch folder can be written");
}

}  // namespace pangea::fuzz

// What libFuzzer calls: its programs have one target each.
extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  static const auto target = pangea::fuzz::Targets().begin()->second;
  return target(data, size);
}
