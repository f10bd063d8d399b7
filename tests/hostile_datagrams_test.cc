// Sends random and mutated raw datagrams on the buses of running programs: the programs must
// survive and do their work. PANGEA_DATAGRAMS: their number (CMakeLists.txt: some by default, 10^6
// among the slow tests).

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <poll.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <map>
#include <memory>
#include <random>
#include <thread>

#include "bus/process.h"
#include "bus/transport/test_datagrams.h"
#include "core/testing/program.h"
#include "link/agent_key.h"
#include "messages/channels.h"
#include "messages/encoding.h"
#include "messages/testing/test_keyframes.h"
#include "pangea/have_t.hpp"
#include "pangea/status_t.hpp"

namespace pangea {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

constexpr int32_t kAgent = 1;
constexpr int64_t kPatience_us = 20'000'000;

int64_t NumDatagrams() {
  const char* const given = std::getenv("PANGEA_DATAGRAMS");
  return given == nullptr ? 30'000 : std::atoll(given);
}

// Receives the raw datagrams of a bus.
class Ear {
 public:
  explicit Ear(const std::string& url)
      : fd_(OpenUdpmSocket(ParseUdpmUrl(url), LcmBus::Fragments::kJoined)) {}
  ~Ear() { close(fd_); }
  Ear(const Ear&) = delete;
  Ear& operator=(const Ear&) = delete;
  std::vector<Datagram> Heard() const {
    std::vector<Datagram> heard;
    Datagram buffer(1 << 16);
    for (ssize_t n = 0; (n = recv(fd_, buffer.data(), buffer.size(), 0)) >= 0;) {
      heard.emplace_back(buffer.begin(), buffer.begin() + n);
    }
    return heard;
  }

 private:
  int fd_;
};

// An attacker without a key who has listened for a while.
class Stranger {
 public:
  Stranger(const std::string& url, const std::string& channel, std::vector<Datagram> heard)
      : sender_(url), channel_(channel), known_(std::move(heard)) {
    for (const Datagram& datagram : MalformedDatagrams(channel)) {
      known_.push_back(datagram);
    }
  }
  void Shout() {
    const uint64_t kind = rng_() % 10;
    sender_.Send(kind < 2 ? Random() : kind < 5 ? RandomFragment() : Mutated());
  }

 private:
  std::string RandomText(size_t most) {
    std::string text(rng_() % (most + 1), ' ');
    for (char& letter : text) {
      letter = static_cast<char>(rng_());
    }
    return text;
  }
  uint32_t RandomNumber() {
    constexpr uint32_t kExtremes[] = {0,      1,          2,          1000,      0x7fff,
                                      0xffff, 0x7fffffff, 0xffffff00, UINT32_MAX};
    return rng_() % 2 == 0 ? kExtremes[rng_() % std::size(kExtremes)]
                           : static_cast<uint32_t>(rng_() % 3000);
  }
  Datagram Random() {
    const std::string text = RandomText(1400);
    return rng_() % 2 == 0 ? ShortDatagram(text) : Datagram(text.begin(), text.end());
  }
  // The fragments are of few messages, so that some of them fit together.
  Datagram RandomFragment() {
    const FragmentHeader header{static_cast<uint32_t>(rng_() % 4), RandomNumber(), RandomNumber(),
                                static_cast<uint16_t>(rng_() % 3),
                                static_cast<uint16_t>(rng_() % 4)};
    const bool named = header.number == 0 && rng_() % 8 != 0;
    return FragmentDatagram(header,
                            (named ? channel_ + std::string(1, '\0') : "") + RandomText(1000));
  }
  Datagram Mutated() {
    Datagram datagram = known_[rng_() % known_.size()];
    for (uint64_t changes = rng_() % 4; changes > 0 && !datagram.empty(); --changes) {
      const size_t most = rng_() % 2 == 0 ? std::min<size_t>(datagram.size(), 40) : datagram.size();
      switch (const size_t at = rng_() % most; rng_() % 3) {
        case 0:
          datagram[at] ^= static_cast<uint8_t>(1 << rng_() % 8);
          break;
        case 1:
          datagram[at] = static_cast<uint8_t>(rng_() % 2 == 0 ? 0 : 0xff);
          break;
        default:
          datagram.resize(at);
      }
    }
    return datagram;
  }

  const DatagramSender sender_;
  const std::string channel_;
  std::vector<Datagram> known_;
  std::mt19937_64 rng_{1};
};

class HostileDatagrams : public testing::Test {
 protected:
  HostileDatagrams() {
    fs::create_directories(folder_);
    MakeKeyFile(folder_ / KeyFileName(kAgent), kAgent);
    const std::string bin = std::string(PANGEA_BINARY_DIR) + "/bin/";
    const auto start = [&](std::vector<std::string> args) {
      args[0] = bin + args[0];
      programs_.push_back(std::make_unique<Program>(std::move(args)));
    };
    start({"pangea-agent-handler", "--link", link_, "--bus", server_, "--journal",
           (folder_ / "journal.lcm").string(), "--keys", folder_.string()});
    start({"pangea-uplink", "--agent", "1", "--key", (folder_ / KeyFileName(kAgent)).string(),
           "--bus", agent_, "--link", link_});
    start({"pangea-posegraph", "--bus", server_});
    start({"pangea-fusion", "--bus", server_});
    ListenTo(agent_bus_);
    ListenTo(server_bus_);
    agent_bus_.Subscribe(std::string(channels::kHave), [this](const std::string&, Bytes data) {
      have_t have{};
      for (size_t i = 0; DecodeMessage(data, &have) && i < have.maps.size(); ++i) {
        journalled_[have.maps[i].opened_utime] = have.highest_seq[i];
      }
    });
  }
  ~HostileDatagrams() override { fs::remove_all(folder_); }

  void ListenTo(LcmBus& bus) {
    bus.Subscribe("STATUS_.*", [this](const std::string&, Bytes data) {
      status_t status{};
      if (DecodeMessage(data, &status)) {
        statuses_[status.pid] = status;
      }
    });
  }
  void HandleAll() {
    while (agent_bus_.Handle(0) || server_bus_.Handle(0)) {
    }
  }
  template <typename Condition>
  bool Wait(Condition condition) {
    for (const int64_t end = SteadyMicros() + kPatience_us; SteadyMicros() < end;) {
      HandleAll();
      if (condition()) {
        return true;
      }
      usleep(10'000);
    }
    return false;
  }
  // Whether keyframes pass from the agent through both programs to the disk and are acknowledged.
  bool Delivers(int64_t opened_utime) {
    constexpr int32_t kKeyframes = 10;
    const MapId map{kAgent, opened_utime};
    for (int32_t seq = 0; seq < kKeyframes; ++seq) {
      agent_bus_.Publish(channels::Keyframe(kAgent), EncodeTestKeyframe({map, seq}));
    }
    return Wait([&] {
      const auto found = journalled_.find(opened_utime);
      return found != journalled_.end() && found->second == kKeyframes - 1;
    });
  }
  // Whether all programs publish a new status.
  bool AllAnswer() {
    statuses_.clear();
    return Wait([&] {
      return std::ranges::all_of(programs_, [&](const std::unique_ptr<Program>& program) {
        return statuses_.contains(program->pid());
      });
    });
  }
  void Flood(std::vector<std::unique_ptr<Stranger>>& strangers) {
    constexpr int64_t kAtOnce = 20;
    constexpr double kRate = 20'000;
    const int64_t count = NumDatagrams(), begin_us = SteadyMicros();
    for (int64_t sent = 0; sent < count; ++sent) {
      strangers[static_cast<size_t>(sent) % strangers.size()]->Shout();
      if (sent % kAtOnce == 0) {
        HandleAll();
        const auto due_us =
            begin_us + static_cast<int64_t>(1e6 * static_cast<double>(sent) / kRate);
        std::this_thread::sleep_for(std::chrono::microseconds(due_us - SteadyMicros()));
      }
    }
  }
  void PrintWhatArrived() {
    for (const auto& program : programs_) {
      const status_t& status = statuses_[program->pid()];
      std::cout << fmt::format("{}: {} messages\n", status.process, status.messages_in);
      for (const auto* counters : {&status.refused, &status.counters}) {
        for (const counter_t& counter : *counters) {
          std::cout << fmt::format("  {} {}\n", counter.count, counter.name);
        }
      }
    }
  }

  const std::string link_ = OwnBusUrl(), server_ = OwnBusUrl(), agent_ = OwnBusUrl();
  const fs::path folder_ = testing::TempDir() + fmt::format("pangea_hostile_{}", getpid());
  LcmBus agent_bus_{agent_}, server_bus_{server_};
  std::vector<std::unique_ptr<Program>> programs_;
  std::map<int32_t, status_t> statuses_;   // by pid
  std::map<int64_t, int32_t> journalled_;  // by the map's opened_utime
};

TEST_F(HostileDatagrams, StopNoProgramAndKeepNoneFromItsWork) {
  ASSERT_TRUE(AllAnswer());
  std::vector<std::unique_ptr<Stranger>> strangers;
  {
    const Ear at_link(link_), at_server(server_), at_agent(agent_);
    ASSERT_TRUE(Delivers(1000));
    strangers.push_back(
        std::make_unique<Stranger>(link_, channels::LinkUp(kAgent), at_link.Heard()));
    strangers.push_back(
        std::make_unique<Stranger>(link_, channels::LinkDown(kAgent), at_link.Heard()));
    strangers.push_back(
        std::make_unique<Stranger>(server_, std::string(channels::kHave), at_server.Heard()));
    strangers.push_back(
        std::make_unique<Stranger>(agent_, channels::Keyframe(kAgent), at_agent.Heard()));
  }
  Flood(strangers);
  EXPECT_TRUE(AllAnswer());
  PrintWhatArrived();
  EXPECT_TRUE(Delivers(2000));
  for (const auto& program : programs_) {
    EXPECT_EQ(program->End(SIGTERM), 0);
  }
}

}  // namespace
}  // namespace pangea
