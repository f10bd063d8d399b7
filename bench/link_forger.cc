// pangea-link-forger: floods a link bus with forged packets while a command (a session) runs, and
// returns the command's exit code. Only for bench/link.
//
// It has no key. It invents packets, and takes overheard ones: replays them late, modifies them,
// reflects them to the sender, and sends them under another agent's name.

#include <fmt/format.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <deque>
#include <iostream>
#include <random>

#include "bus/process.h"
#include "link/poll_loop.h"
#include "messages/channels.h"

namespace pangea {
namespace {

constexpr size_t kRemembered = 4000;
constexpr size_t kLargest = 1450;
constexpr int kBatch_us = 2000;
// Wait, because the session first checks that its ports are free.
constexpr int64_t kListenAfter_us = 5'000'000;

struct Packet {
  std::string channel;
  std::vector<uint8_t> bytes;
};

class Forger {
 public:
  Forger(Bus& link, std::vector<int32_t> agents) : link_(link), agents_(std::move(agents)) {}

  void Overhear(LcmBus& bus) {
    bus.Subscribe("LINK_.*", [this](const std::string& channel, Bytes bytes) {
      heard_.push_back({channel, {bytes.begin(), bytes.end()}});
      if (heard_.size() > kRemembered) {
        heard_.pop_front();
      }
    });
  }

  void Shout() {
    const Packet packet = heard_.empty() || rng_() % 100 < 40 ? MadeUp() : Twisted();
    link_.Publish(packet.channel, packet.bytes);
  }

 private:
  int32_t AnAgent() { return agents_[rng_() % agents_.size()]; }

  Packet MadeUp() {
    std::vector<uint8_t> bytes(1 + rng_() % kLargest);
    for (uint8_t& byte : bytes) {
      byte = static_cast<uint8_t>(rng_());
    }
    const bool up = rng_() % 8 != 0;
    bytes[0] = static_cast<uint8_t>(up ? 1 + rng_() % 4 : 16 + rng_() % 2);
    return {up ? channels::LinkUp(AnAgent()) : channels::LinkDown(AnAgent()), std::move(bytes)};
  }

  Packet Twisted() {
    Packet packet = heard_[rng_() % heard_.size()];
    switch (rng_() % 5) {
      case 0:
        packet.bytes[rng_() % packet.bytes.size()] ^= static_cast<uint8_t>(1 + rng_() % 255);
        break;
      case 1:
        packet.channel = channels::LinkUp(AnAgent());
        break;
      case 2:
        packet.channel = channels::LinkDown(AnAgent());
        break;
      case 3:
        packet.channel = channels::LinkUp(static_cast<int32_t>(60'000 + rng_() % 1000));
        break;
      default:  // unchanged
        break;
    }
    return packet;
  }

  Bus& link_;
  const std::vector<int32_t> agents_;
  std::deque<Packet> heard_;
  std::mt19937_64 rng_{1};
};

pid_t Start(const std::vector<std::string>& command) {
  const pid_t pid = fork();
  if (pid == 0) {
    std::vector<char*> argv;
    for (const std::string& word : command) {
      argv.push_back(const_cast<char*>(word.c_str()));
    }
    argv.push_back(nullptr);
    execvp(argv[0], argv.data());
    _exit(127);
  }
  return pid;
}

struct Arguments {
  std::string link;
  std::vector<std::string> overheard;
  std::vector<int32_t> agents;
  int64_t packets = 1'000'000;
  double packets_per_s = 15'000;
  std::vector<std::string> command;
};

int Run(const Arguments& arguments) {
  InstallSignalHandlers();
  LcmBus link(arguments.link);
  Forger forger(link, arguments.agents);
  std::deque<LcmBus> buses;
  const pid_t child = Start(arguments.command);
  const int64_t begin_us = SteadyMicros();
  int64_t sent = 0;
  int status = 0;
  while (waitpid(child, &status, WNOHANG) == 0) {
    if (StopRequested()) {
      kill(child, SIGTERM);
    }
    if (buses.empty() && SteadyMicros() - begin_us > kListenAfter_us) {
      for (const std::string& url : arguments.overheard) {
        forger.Overhear(buses.emplace_back(url));
      }
    }
    for (LcmBus& bus : buses) {
      while (bus.Handle(0)) {
      }
    }
    const auto due = static_cast<int64_t>(arguments.packets_per_s * 1e-6 *
                                          static_cast<double>(SteadyMicros() - begin_us));
    for (; sent < std::min(due, arguments.packets); ++sent) {
      forger.Shout();
    }
    usleep(kBatch_us);
  }
  std::cout << fmt::format("forged packets: {}\n", sent);
  return WIFEXITED(status) ? WEXITSTATUS(status) : 1;
}

}  // namespace
}  // namespace pangea

int main(int argc, char** argv) {
  CLI::App app("Floods a link bus with forged packets while a command runs", "pangea-link-forger");
  pangea::Arguments arguments;
  app.add_option("--link", arguments.link, "LCM URL of the link bus to flood")->required();
  app.add_option("--overhear", arguments.overheard, "LCM URLs of link buses whose packets it uses");
  app.add_option("--agents", arguments.agents, "agents it pretends to be")->required();
  app.add_option("--packets", arguments.packets, "how many")->capture_default_str();
  app.add_option("--packets-per-s", arguments.packets_per_s)->capture_default_str();
  app.add_option("command", arguments.command, "the command, after --")->required();
  CLI11_PARSE(app, argc, argv);
  try {
    return pangea::Run(arguments);
  } catch (const std::exception& error) {
    std::cerr << fmt::format("pangea-link-forger: {}\n", error.what());
    return 1;
  }
}
