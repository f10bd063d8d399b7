#include "cluster/bridge_test_world.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <random>
#include <stdexcept>
#include <thread>

#include "bus/retransmission/missing.h"
#include "bus/wall_clock.h"
#include "core/server_messages.h"
#include "messages/catch_up_messages.h"
#include "messages/channels.h"
#include "messages/encoding.h"
#include "messages/messages.h"
#include "messages/testing/test_keyframes.h"

namespace pangea {
namespace {

using namespace std::chrono_literals;

constexpr char kSite[] = "hall";
constexpr size_t kMaxMatches = 4;
const MapId kMap{1, 1'700'000'000'000'000};
const MapId kOther{2, 1'700'000'000'000'000};

std::string FreshJournal(const std::string& path) {
  for (const char* suffix : {"", ".stream"}) {
    std::filesystem::remove(path + suffix);
  }
  return path;
}

// Candidates alternate between kInter and kIntra.
PlaceKind KindOf(int candidate) {
  return candidate % 2 == 0 ? PlaceKind::kInter : PlaceKind::kIntra;
}

}  // namespace

// Below the ports that Linux gives to clients: while nats-server is down, no other program gets its
// port, and no client that connects again can connect to itself.
int FreePort() {
  constexpr int kFirst = 20'000, kCount = 12'000;
  std::mt19937 random{std::random_device{}()};
  for (int i = 0; i < 100; ++i) {
    const int port = kFirst + static_cast<int>(random() % kCount);
    const int fd = socket(AF_INET, SOCK_STREAM, 0);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    address.sin_port = htons(static_cast<uint16_t>(port));
    const bool is_free = bind(fd, reinterpret_cast<sockaddr*>(&address), sizeof address) == 0;
    close(fd);
    if (is_free) {
      return port;
    }
  }
  throw std::runtime_error("no port is free");
}

std::string NatsServerProgram() {
  for (const char* path : {"/usr/sbin/nats-server", "/usr/bin/nats-server"}) {
    if (access(path, X_OK) == 0) {
      return path;
    }
  }
  return "";
}

NatsServer::NatsServer(const std::filesystem::path& store)
    : store_(store), port_(FreePort()), access_{fmt::format("nats://127.0.0.1:{}", port_), {}, {}} {
  std::filesystem::remove_all(store_);
  Start();
}

void NatsServer::Start() {
  program_ = std::make_unique<Program>(
      std::vector<std::string>{NatsServerProgram(), "-a", "127.0.0.1", "-p", std::to_string(port_),
                               "-js", "-sd", store_.string(), "-l", store_.string() + ".log"});
  const auto end = std::chrono::steady_clock::now() + 20s;
  while (std::chrono::steady_clock::now() < end) {
    try {
      NatsClient(access_, "test");
      return;
    } catch (const std::runtime_error&) {
      std::this_thread::sleep_for(50ms);
    }
  }
  throw std::runtime_error("nats-server does not start; see " + store_.string() + ".log");
}

TestServer::TestServer(const NatsAccess& access, const std::string& journal_path)
    : access_(access), journal_path_(FreshJournal(journal_path)) {
  journal_file_ = std::make_unique<Journal>(
      journal_path_, [](const std::string&, Bytes, const JournalPlace&) { return true; });
  StartBridge(kSite);
}

void TestServer::StartBridge(const std::string& site) {
  streams_ = std::make_unique<SiteStreams>(access_, site);
  streams_->Make(0, kTestAckWait_us);
  lease_ = std::make_unique<SiteLease>(*streams_, "first");
  if (!lease_->TryAcquire(WallUtime())) {
    throw std::runtime_error(lease_->seen_holder() + " has the site");
  }
  bus_ = std::make_unique<LocalBus>();
  node_ = std::make_unique<Node>(*bus_, "agent_handler");
  node_->Subscribe<constraint_t>("CONSTRAINT", [this](const std::string&, const constraint_t& m) {
    ++published_[m.id];
    TakeResult(m);
  });
  node_->Subscribe<again_t>("AGAIN_agent_handler", [this](const std::string&, const again_t& m) {
    constraint_t result{};
    num_again_ += DecodeMessage(m.data, &result) ? 1 : 0;
  });
  node_->Listen<resend_request_t>("RESEND_REQUEST",
                                  std::bind_front(&TestServer::OnResendRequest, this));
  node_->Listen<journal_file_t>("JOURNAL_REPLICATED", [this](const JournalFile& file) {
    EXPECT_EQ(file.path, journal_path_);
    replicated_bytes_ = file.state.num_bytes;
  });
  bridge_ = std::make_unique<CoreBridge>(*bus_, *streams_, *lease_);
  SayJournalFile();
}

void TestServer::RestartBridge(const std::string& site) {
  bridge_.reset();
  StartBridge(site);
}

void TestServer::TakeResult(const constraint_t& result) {
  if (journal_.emplace(result.id, result).second) {
    journal_file_->Append(1, "CONSTRAINT", EncodeMessage(result));
  }
}

void TestServer::SayJournalFile() {
  journal_file_->Sync();
  node_->Publish("JOURNAL_FILE", ToMessage(JournalFile{journal_path_, journal_file_->state()}));
}

void TestServer::Add(int candidates) {
  const auto count = static_cast<int>(keyframes_.size());
  const KeyframeId query{{kMap.agent_id, kMap.opened_utime + count % num_maps_}, count / num_maps_};
  PlaceMatch match;
  match.query = query;
  for (int i = 0; i < candidates; ++i) {
    match.candidates.push_back({{kOther, count + i}, KindOf(i), 0.5f, {}});
    candidates_.insert(ConstraintId(query, match.candidates.back()));
  }
  const KeyframeMessage& keyframe = keyframes_[query] = ToMessage(TestKeyframe(query));
  journal_file_->Append(kMap.opened_utime + count, "KEYFRAME_1", EncodeMessage(keyframe));
  SayJournalFile();
  node_->Publish("KEYFRAME_1", keyframe);
  node_->Publish("PLACE_MATCH", matches_[query] = ToMessage(match));
}

void TestServer::SayHave() {
  std::map<MapId, int32_t> highest_seq;
  for (const auto& [id, keyframe] : keyframes_) {
    highest_seq[id.map] = id.seq;
  }
  have_t have{};
  have.num_maps = static_cast<int32_t>(highest_seq.size());
  for (const auto& [map, seq] : highest_seq) {
    have.maps.push_back(ToMessage(map));
    have.highest_seq.push_back(seq);
  }
  node_->Publish("HAVE", have);
}

void TestServer::AskForResults(int32_t seq) {
  ResultNames names{kMap, {}};
  for (const auto& [id, result] : journal_) {
    if (result.to.seq == seq) {
      names.results.emplace_back(seq, id);
    }
  }
  RequestResults(*node_, names);
}

void TestServer::OnResendRequest(const ResendRequest& request) {
  for (int32_t seq = request.range.from_seq; seq <= request.range.to_seq; ++seq) {
    const KeyframeId id{request.range.map, seq};
    if (request.channel == "PLACE_MATCH") {
      Retransmit(*node_, request.requester, request.channel, matches_.at(id));
    } else if (request.channel == "KEYFRAME_1") {
      Retransmit(*node_, request.requester, request.channel, keyframes_.at(id));
    }
  }
  for (const auto& [id, result] : journal_) {
    if (request.channel == "CONSTRAINT") {
      Retransmit(*node_, request.requester, request.channel, result);
    }
  }
}

void TestServer::Round(int64_t now_utime) {
  bus_->Drain();
  bridge_->BetweenMessages(now_utime);
  bridge_->Tick(now_utime);
  bus_->Drain();
}

TestWorker::TestWorker(const NatsAccess& access)
    : node_(bus_, "fusion"), streams_(access, kSite), bridge_(bus_, streams_, kMaxMatches) {
  node_.Subscribe<KeyframeMessage>("KEYFRAME_1",
                                   [this](const std::string&, const KeyframeMessage& m) {
                                     keyframes_.insert(*Parse(m.id).value);
                                   });
  node_.Listen<place_match_t>("PLACE_MATCH", std::bind_front(&TestWorker::TakeMatch, this));
  node_.Listen<verdict_request_t>("VERDICT_REQUEST", [this](const VerificationRequest& request) {
    for (const auto& [seq, id] : request.names.results) {
      if (made_.contains(id)) {
        Retransmit(node_, request.requester, "CONSTRAINT", ToMessage(made_.at(id)));
      }
    }
  });
  const auto take_again = [this](const std::string&, const again_t& again) {
    constraint_t result{};
    KeyframeMessage keyframe{};
    if (DecodeMessage(again.data, &result) && !made_.contains(result.id)) {
      results_of_others_.insert(result.id);
    } else if (DecodeMessage(again.data, &keyframe)) {
      retransmitted_.push_back(keyframe.id.seq);
    }
  };
  node_.Subscribe<again_t>("AGAIN_fusion", take_again);
  node_.Subscribe<again_t>("AGAIN_inter_map_ba", take_again);
}

void TestWorker::TakeMatch(const PlaceMatch& match) {
  if (!known_at_.emplace(match.query, made_.size() + results_of_others_.size()).second) {
    return;
  }
  for (const PlaceCandidate& candidate : match.candidates) {
    Constraint result;
    result.from = candidate.match;
    result.to = match.query;
    result.kind = candidate.kind;
    result.reason = "a test's";
    to_verify_.push_back(result);
  }
}

void TestWorker::Verify() {
  if (to_verify_.empty() || pauses_) {
    return;
  }
  const Constraint result = to_verify_.front();
  to_verify_.pop_front();
  if (results_of_others_.contains(result.Id())) {
    return;
  }
  made_.emplace(result.Id(), result);
  if (to_lose_ > 0) {
    --to_lose_;
  } else {
    node_.Publish("CONSTRAINT", ToMessage(result));
  }
}

void TestWorker::AskForKeyframes(int32_t from_seq, int32_t to_seq) {
  RequestRetransmission(node_, "KEYFRAME_1", {kMap, from_seq, to_seq});
  RequestRetransmission(node_, "PLACE_MATCH", {kMap, from_seq, to_seq});
}

void TestWorker::Round(int64_t now_utime) {
  if (!killed_) {
    Verify();
    bus_.Drain();
    bridge_.BetweenMessages(now_utime);
    bridge_.Tick(now_utime);
    bus_.Drain();
  }
}

void ClusterTest::SetUp() {
  if (NatsServerProgram().empty()) {
    GTEST_SKIP() << "nats-server is not installed: scripts/setup scripts/packages_cluster.txt";
  }
  nats_ = std::make_unique<NatsServer>(files_);
  server_ = std::make_unique<TestServer>(nats_->access(), files_ + ".lcm");
}

}  // namespace pangea
