// The real program: 50 agents at once, what they take of its memory, and a kill while they join.

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <chrono>
#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>
#include <thread>

#include "bus/process.h"
#include "bus/transport/test_datagrams.h"
#include "core/testing/program.h"
#include "files/text_file.h"
#include "gateway/admission.h"
#include "gateway/identity.h"
#include "gateway/test_client.h"
#include "link/agent_key.h"

namespace pangea {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using namespace std::chrono_literals;

class GatewayProgram : public testing::Test {
 protected:
  GatewayProgram() : link_url_(OwnBusUrl()), bus_url_(OwnBusUrl()) {
    fs::remove_all(folder_);
    site_ = site::OpenSite(folder_);
  }

  // Until it can be reached.
  void Start() {
    fs::remove(site_.gateway() / "address.json");
    program_ = std::make_unique<Program>(std::vector<std::string>{
        PANGEA_BINARY_DIR "/bin/pangea-gateway", "--site", folder_.string(), "--link", link_url_,
        "--bus", bus_url_, "--listen", "127.0.0.1", "--port", "0"});
    for (int i = 0; i < 200 && !Exists(site_.gateway() / "address.json"); ++i) {
      std::this_thread::sleep_for(50ms);
    }
    const std::string url = ReadAddress(site_).url;
    port_ = static_cast<uint16_t>(std::stoi(url.substr(url.rfind(':') + 1)));
  }
  // Runs `pangea-gateway invite`; returns its exit status and what it printed.
  std::pair<int, std::string> Invite(const std::string& arguments) const {
    const std::string command = fmt::format("{}/bin/pangea-gateway invite --site {} {} 2>&1",
                                            PANGEA_BINARY_DIR, folder_.string(), arguments);
    FILE* const program = popen(command.c_str(), "r");
    std::array<char, 65536> said{};
    const size_t size = fread(said.data(), 1, said.size(), program);
    const int status = pclose(program);
    return {WEXITSTATUS(status), std::string(said.data(), size)};
  }
  int64_t MemoryKb() const {
    std::ifstream status(fmt::format("/proc/{}/status", program_->pid()));
    for (std::string word; status >> word;) {
      if (word == "VmRSS:") {
        int64_t kb = 0;
        status >> kb;
        return kb;
      }
    }
    return 0;
  }

  const fs::path folder_ = testing::TempDir() + "/gateway_program";
  const std::string link_url_, bus_url_;
  site::Site site_;
  std::unique_ptr<Program> program_;
  uint16_t port_ = 0;
};

TEST_F(GatewayProgram, FiftyAgentsAtOnceInBoundedMemory) {
  constexpr int kAgents = 50;
  std::map<int32_t, SecretKey> keys;
  for (int32_t id = 1; id <= kAgents; ++id) {
    MakeKeyFile(site_.keys() / KeyFileName(id), id);
    keys.emplace(id, ReadKeyFileOf(site_.keys() / KeyFileName(id), id));
  }
  LcmBus link_bus(link_url_, LcmBus::Fragments::kRefused);
  std::map<std::string, int> up;
  link_bus.Subscribe("LINK_UP_[0-9]+", [&](const std::string& channel, Bytes) { ++up[channel]; });
  Start();
  const int64_t before_kb = MemoryKb();

  std::vector<std::unique_ptr<GatewayAgent>> agents;
  std::map<int32_t, size_t> down;
  const auto run = [&](auto done) {
    for (int i = 0; i < 1000 && !done(); ++i) {
      for (size_t k = 0; k < agents.size(); ++k) {
        down[static_cast<int32_t>(k) + 1] += agents[k]->Received().size();
      }
      while (link_bus.Handle(0)) {
      }
      std::this_thread::sleep_for(5ms);
    }
  };
  for (const auto& [id, key] : keys) {
    agents.push_back(std::make_unique<GatewayAgent>(port_, id, key));
  }
  run([&] {
    return std::ranges::all_of(agents, [](const auto& agent) { return agent->proven(); });
  });
  for (const auto& agent : agents) {
    agent->Send(std::vector<uint8_t>(30'000, 7));
  }
  run([&] { return up.size() == kAgents; });
  EXPECT_EQ(up.size(), size_t{kAgents});
  for (int32_t id = 1; id <= kAgents; ++id) {
    link_bus.Publish(fmt::format("LINK_DOWN_{}", id), std::vector<uint8_t>(1400, 9));
  }
  run([&] {
    return std::ranges::count_if(down, [](auto& d) { return d.second == 1; }) == kAgents;
  });
  for (const auto& [id, count] : down) {
    EXPECT_EQ(count, 1U) << "agent " << id;
  }
  const int64_t each_kb = (MemoryKb() - before_kb) / kAgents;
  std::cout << fmt::format("before {} kB, each agent {} kB\n", before_kb, each_kb);
  EXPECT_LT(each_kb, 200);
}

TEST_F(GatewayProgram, InvitesNobodyWhoseNameIsNotUtf8) {
  Start();
  const auto [status, said] = Invite("--name \"$(printf 'Ann\\303')\"");
  EXPECT_EQ(status, 1);
  EXPECT_EQ(said, "pangea-gateway: --name: give at most 120 bytes of UTF-8 that can be shown\n");
  EXPECT_TRUE(fs::is_empty(site_.gateway() / "invites"));
}

TEST_F(GatewayProgram, ExpiredInvitesTakeNoRoom) {
  Start();
  for (size_t i = 0; i < Admission::kMaxInvites; ++i) {
    std::ofstream(site_.gateway() / "invites" / fmt::format("{}.json", i))
        << R"({"anchors": "own", "expires_s": 1, "name": ""})";
  }
  const auto [status, said] = Invite("--name Anna");
  EXPECT_EQ(status, 0) << said;
  EXPECT_THAT(said, testing::HasSubstr("for one agent, until"));
}

// An agent that got a key and lost the gateway tries again. One code never yields two keys.
TEST_F(GatewayProgram, AKillWhileAgentsJoinHandsNoCodeOutTwice) {
  for (int round = 0; round < 8; ++round) {
    Start();
    const std::string code =
        Admission(site_).Make({"", AnchorRight::kEditOwn, WallUtime() / 1'000'000 + 3600});
    const std::string body = json({{"code", code}}).dump();
    int given = 0;
    for (const bool killed : {true, false}) {
      web::TlsClient client(port_);
      client.Send(
          fmt::format("POST /v1/join HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: {}\r\n\r\n{}",
                      body.size(), body));
      std::string answer;
      for (int i = 0; i < (killed ? round : 100) && answer.empty(); ++i) {
        std::this_thread::sleep_for(10ms);
        answer = client.Received();
      }
      if (killed) {
        program_->End(SIGKILL);
        answer += client.Received();
        Start();
      }
      given += answer.starts_with("HTTP/1.1 200") ? 1 : 0;
    }
    EXPECT_LE(given, 1) << "round " << round;
    program_->End(SIGTERM);
  }
}

}  // namespace
}  // namespace pangea
