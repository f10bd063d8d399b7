#pragma once

// The gateway as a web site: the phone's page, joining, and the agents' WebSockets. It has no
// network socket, bus, clock or file: the owner provides requests, the time, the keys and the
// packets that go down, and gets the packets that come up. Not thread safe.
//
//   GET  /...                the page
//   GET  /ca.crt             the certificate of the authority, for a phone that should trust it
//   GET  /v1/info            {"site", "version", "agents": [{"agent", "name", "connected"}]}
//   POST /v1/join            {"code", "name"}: {"agent", "key", "site"}, or {"error"}
//   WS   /link?agent=K       link_socket.h
//   WS   /recording?agent=K  recording/recording_socket.h
//
// Bounds: kMaxAgentsAtOnce link sockets and kMaxUploads uploads with a proven key, and kMaxUnproven
// sockets without; a further unproven one replaces the oldest.

#include <functional>
#include <list>
#include <map>
#include <memory>
#include <string>

#include "gateway/attempt_limit.h"
#include "gateway/join_request.h"
#include "gateway/link_socket.h"
#include "gateway/recording/recording_socket.h"
#include "web/page_files.h"

namespace pangea {

// The result of a valid request to join.
struct JoinResult {
  static constexpr int kWrongCode = 403;
  int status = 200;
  std::string error;  // for the visitor, if the status is not 200
  int32_t agent_id = 0;
  std::string key_hex;
};

class Gateway : public web::WebSite, public LinkSocketOwner, public RecordingSocketOwner {
 public:
  static constexpr size_t kMaxAgentsAtOnce = 100;
  static constexpr size_t kMaxUnproven = kMaxAgentsAtOnce;  // all agents may return at once
  static constexpr size_t kMaxUploads = 4;
  // All sockets, and as many that are being closed.
  static constexpr int kMaxPeers = 2 * (kMaxAgentsAtOnce + kMaxUnproven + kMaxUploads);

  struct Public {
    std::string site;  // the site's name
    std::string version;
    web::Page page;
    std::string authority_der;  // empty: the user has an own certificate
  };
  struct Agent {
    SecretKey key;
    std::string name;
  };
  struct Events {
    std::function<JoinResult(const JoinRequest&)> join;
    std::function<void(int32_t agent_id, Bytes packet)> packet_up;
    std::function<void(const std::string& why)> refused;
    std::function<void()> dropped;
  };

  // `recordings` must outlive the gateway.
  Gateway(Public what, Events events, RecordingStore& recordings)
      : public_(std::move(what)), events_(std::move(events)), recordings_(recordings) {}

  // Call it often. `now_us`: monotonic clock.
  void SetNow(int64_t now_us) { now_us_ = now_us; }
  // Sets the agents that may connect. Sockets of other agents, or with another key, are closed.
  void SetAgents(std::map<int32_t, Agent> agents);
  void SendDown(int32_t agent_id, Bytes packet);
  int64_t num_connected() const { return static_cast<int64_t>(connected_.size()); }

  void Answer(const web::WebRequest& request, Reply reply) override;
  std::unique_ptr<web::WebPeer> Open(const web::WebRequest& request) override;
  void Refused(const std::string& why) override { events_.refused(why); }

 private:
  web::WebAnswer Join(const web::WebRequest& request);
  web::WebAnswer Info() const;
  web::WebAnswer File(const web::WebRequest& request) const;

  bool OnProof(AgentSocket* socket, Bytes proof) override;
  bool OnLink(LinkSocket* socket) override;
  bool OnUpload(RecordingSocket* socket) override;
  void OnPacketUp(int32_t agent_id, Bytes packet) override { events_.packet_up(agent_id, packet); }
  void OnRefused(const std::string& why) override { events_.refused(why); }
  void OnDropped() override { events_.dropped(); }
  void OnGone(AgentSocket* socket) override;
  RecordingStore& recordings() override { return recordings_; }
  int64_t now_us() const override { return now_us_; }

  const Public public_;
  const Events events_;
  RecordingStore& recordings_;
  int64_t now_us_ = 0;
  std::map<int32_t, Agent> agents_;
  std::map<int32_t, LinkSocket*> connected_;
  std::map<int32_t, RecordingSocket*> uploads_;
  std::list<AgentSocket*> unproven_;  // oldest first
  AttemptLimit wrong_codes_;
};

}  // namespace pangea
