#pragma once

// For tests: a real nats-server on a loopback port, and a server and workers of the site "hall" on
// one thread. The bridges are the real ones; agent_handler, place_recognition and the verifiers are
// replaced by the least that their part on the bus needs.

#include <gtest/gtest.h>

#include <chrono>
#include <deque>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "agent_handler/journal/journal.h"
#include "bus/bus.h"
#include "cluster/core_bridge.h"
#include "cluster/site_lease.h"
#include "cluster/site_streams.h"
#include "cluster/worker_bridge.h"
#include "core/testing/program.h"
#include "pangea/constraint_t.hpp"
#include "pangea/place_match_t.hpp"

namespace pangea {

inline constexpr int64_t kTestAckWait_us = 2'000'000;

// Path of nats-server; empty when it is not installed.
std::string NatsServerProgram();

int FreePort();

class NatsServer {
 public:
  // A server without TLS and users.
  explicit NatsServer(const std::filesystem::path& store);
  const NatsAccess& access() const { return access_; }
  void Stop() { program_->End(SIGKILL); }
  void Start();

 private:
  const std::filesystem::path store_;
  const int port_;
  const NatsAccess access_;
  std::unique_ptr<Program> program_;
};

// Stands for agent_handler and place_recognition: maps of one agent, and one match per keyframe.
class TestServer {
 public:
  // The journal is a new file at this path, which no other test program may use.
  TestServer(const NatsAccess& access, const std::string& journal_path);

  // Keyframes come from this many maps by turns (1 by default). Matches of the same map wait for
  // each other.
  void set_num_maps(int num_maps) { num_maps_ = num_maps; }
  // Publishes the next keyframe and its match with this many candidates.
  void Add(int candidates);
  void SayHave();
  // As agent_handler, asks for all results of this keyframe of the first map.
  void AskForResults(int32_t seq);
  // Kills the bridge, and starts it again with what the journal has.
  void RestartBridge(const std::string& site = "hall");
  // Throws LeaseLost if another core has the site.
  void Round(int64_t now_utime);
  // Handles only the bus, as a bridge does before it checks its lease.
  void Drain() { bus_->Drain(); }

  const std::string& journal_path() const { return journal_path_; }
  // Whether all that the journal has may be acknowledged.
  bool all_replicated() const { return replicated_bytes_ == journal_file_->size(); }
  const std::set<int64_t>& candidates() const { return candidates_; }
  // How often each result was published.
  const std::map<int64_t, int>& published() const { return published_; }
  bool has_all() const { return journal_.size() == candidates_.size(); }
  int num_again() const { return num_again_; }

  SiteStreams& streams() { return *streams_; }

 private:
  void StartBridge(const std::string& site);
  void OnResendRequest(const ResendRequest& request);
  void TakeResult(const constraint_t& result);
  void SayJournalFile();

  const NatsAccess access_;
  const std::string journal_path_;
  std::unique_ptr<Journal> journal_file_;
  int64_t replicated_bytes_ = -1;
  std::unique_ptr<SiteStreams> streams_;
  std::unique_ptr<LocalBus> bus_;
  std::unique_ptr<Node> node_;  // agent_handler's
  std::unique_ptr<SiteLease> lease_;
  std::unique_ptr<CoreBridge> bridge_;
  int num_maps_ = 1;
  std::map<KeyframeId, KeyframeMessage> keyframes_;
  std::map<KeyframeId, place_match_t> matches_;
  std::map<int64_t, constraint_t> journal_;
  std::set<int64_t> candidates_;
  std::map<int64_t, int> published_;
  int num_again_ = 0;
};

// A worker's bridge and a verifier that verifies one candidate per round.
class TestWorker {
 public:
  explicit TestWorker(const NatsAccess& access);

  void Round(int64_t now_utime);
  // As kill -9: the worker does nothing more.
  void Kill() { killed_ = true; }
  void set_pauses(bool pauses) { pauses_ = pauses; }
  // The next `count` results do not reach the bridge.
  void LoseResults(int count) { to_lose_ = count; }
  void AskForKeyframes(int32_t from_seq, int32_t to_seq);

  int num_verified() const { return static_cast<int>(made_.size()); }
  size_t num_waiting() const { return to_verify_.size(); }
  const std::set<KeyframeId>& keyframes() const { return keyframes_; }
  const std::vector<int32_t>& retransmitted() const { return retransmitted_; }
  const std::set<int64_t>& results_of_others() const { return results_of_others_; }
  // For each query, the number of results that it knew when it took the match.
  const std::map<KeyframeId, size_t>& known_at() const { return known_at_; }

 private:
  void TakeMatch(const PlaceMatch& match);
  void Verify();

  LocalBus bus_;
  Node node_;  // fusion's
  SiteStreams streams_;
  WorkerBridge bridge_;
  std::map<KeyframeId, size_t> known_at_;
  std::deque<Constraint> to_verify_;
  std::map<int64_t, Constraint> made_;
  std::set<KeyframeId> keyframes_;
  std::vector<int32_t> retransmitted_;
  std::set<int64_t> results_of_others_;
  bool pauses_ = false;
  int to_lose_ = 0;
  bool killed_ = false;
};

// A nats-server and the core of a site. Tests are skipped if nats-server is not installed.
class ClusterTest : public testing::Test {
 protected:
  // `name`: for the files; no other test may use it.
  explicit ClusterTest(const std::string& name) : files_(testing::TempDir() + "/cluster_" + name) {}
  void SetUp() override;

  const std::string files_;
  std::unique_ptr<NatsServer> nats_;
  std::unique_ptr<TestServer> server_;
};

}  // namespace pangea
