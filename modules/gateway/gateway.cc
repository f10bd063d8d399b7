#include "gateway/gateway.h"

#include <fmt/format.h>
#include <sodium.h>

#include <charconv>
#include <nlohmann/json.hpp>
#include <optional>
#include <string_view>
#include <utility>
#include <variant>

namespace pangea {
namespace {

using nlohmann::json;
using web::WebAnswer;
using web::WebRequest;

WebAnswer Json(int status, const json& body) {
  return {status, "application/json",
          body.dump(-1, ' ', false, json::error_handler_t::replace) + "\n"};
}

WebAnswer Error(int status, const std::string& error) { return Json(status, {{"error", error}}); }

// The page's Content-Security-Policy. It names `host`, which HostAllowed has accepted, because only
// new versions of Safari accept 'self' for wss:.
std::string PagePolicy(const std::string& host) {
  return fmt::format(
      "default-src 'self'; script-src 'self' 'wasm-unsafe-eval'; worker-src 'self' blob:; "
      "connect-src 'self' wss://{}; img-src 'self' blob: data:; media-src 'self' blob:; style-src "
      "'self' 'unsafe-inline'; object-src 'none'; base-uri 'none'; form-action 'none'; "
      "frame-ancestors 'none'",
      host);
}

// The agent of a target: 7 for the target "/link?agent=7" and the path "/link".
std::optional<int32_t> AgentOf(std::string_view target, std::string_view path) {
  constexpr std::string_view kAgent = "?agent=";
  if (!target.starts_with(path) || !target.substr(path.size()).starts_with(kAgent)) {
    return std::nullopt;
  }
  const std::string_view digits = target.substr(path.size() + kAgent.size());
  int32_t agent_id = 0;
  const char* const last = digits.data() + digits.size();
  const auto [end, error] = std::from_chars(digits.data(), last, agent_id);
  return error == std::errc() && end == last && agent_id >= 1 && agent_id <= 65535
             ? std::optional(agent_id)
             : std::nullopt;
}

// Closes the sockets of agents whose key has changed or is missing in `after`.
template <typename Socket>
void EndOthers(const std::map<int32_t, Gateway::Agent>& before,
               const std::map<int32_t, Gateway::Agent>& after,
               std::map<int32_t, Socket*>* sockets) {
  for (auto it = sockets->begin(); it != sockets->end();) {
    Socket* const socket = it->second;
    const auto agent = after.find(it->first);
    if (agent != after.end() && agent->second.key == before.at(it->first).key) {
      ++it;
    } else {
      it = sockets->erase(it);
      socket->End(kNotKnown);
    }
  }
}

// The socket replaces the agent's former one, or takes a free place. False, and the socket is
// closed, if there is no place.
template <typename Socket>
bool TakePlace(Socket* socket, size_t max_at_once, std::map<int32_t, Socket*>* sockets) {
  if (const auto former = sockets->find(socket->agent_id()); former != sockets->end()) {
    former->second->End(kReplaced);
  } else if (sockets->size() >= max_at_once) {
    socket->End(kTooMany);
    return false;
  }
  (*sockets)[socket->agent_id()] = socket;
  return true;
}

}  // namespace

void Gateway::SetAgents(std::map<int32_t, Agent> agents) {
  EndOthers(agents_, agents, &connected_);
  EndOthers(agents_, agents, &uploads_);
  agents_ = std::move(agents);
}

void Gateway::SendDown(int32_t agent_id, Bytes packet) {
  if (const auto connected = connected_.find(agent_id); connected != connected_.end()) {
    connected->second->SendDown(packet);
  }
}

void Gateway::Answer(const WebRequest& request, Reply reply) {
  if (request.target == "/v1/join") {
    reply(Join(request));
  } else if (request.target == "/v1/info") {
    reply(request.method == "GET" ? Info() : Error(405, "Only GET here."));
  } else {
    reply(File(request));
  }
}

WebAnswer Gateway::Join(const WebRequest& request) {
  if (request.method != "POST") {
    return Error(405, "Only POST here.");
  }
  if (!wrong_codes_.MayTry(request.address, now_us_)) {
    events_.refused("join: too many wrong codes");
    WebAnswer answer = Error(429, "There were too many wrong codes. Wait a minute.");
    answer.headers.emplace_back("Retry-After", "60");
    return answer;
  }
  const auto parsed = ParseJoinRequest(request.body);
  if (const auto* const wrong = std::get_if<std::string>(&parsed)) {
    wrong_codes_.NoteWrong(request.address, now_us_);
    events_.refused("join: the request is malformed");
    return Error(400, *wrong);
  }
  const JoinResult result = events_.join(std::get<JoinRequest>(parsed));
  if (result.status == 200) {
    return Json(200, {{"agent", result.agent_id}, {"key", result.key_hex}, {"site", public_.site}});
  }
  if (result.status == JoinResult::kWrongCode) {
    wrong_codes_.NoteWrong(request.address, now_us_);
  }
  events_.refused("join: " + result.error);
  return Error(result.status, result.error);
}

WebAnswer Gateway::Info() const {
  json agents = json::array();
  for (const auto& [agent_id, agent] : agents_) {
    agents.push_back(
        {{"agent", agent_id}, {"name", agent.name}, {"connected", connected_.contains(agent_id)}});
  }
  return Json(
      200, {{"site", public_.site}, {"version", public_.version}, {"agents", std::move(agents)}});
}

WebAnswer Gateway::File(const WebRequest& request) const {
  if (request.target == "/ca.crt" && request.method == "GET" && !public_.authority_der.empty()) {
    return {200, "application/x-x509-ca-cert", public_.authority_der};
  }
  WebAnswer answer = web::AnswerFile(public_.page, request, PagePolicy(request.host));
  // The first two headers let the page use shared memory. The third hides its address from others.
  answer.headers.emplace_back("Cross-Origin-Opener-Policy", "same-origin");
  answer.headers.emplace_back("Cross-Origin-Embedder-Policy", "require-corp");
  answer.headers.emplace_back("Referrer-Policy", "no-referrer");
  return answer;
}

std::unique_ptr<web::WebPeer> Gateway::Open(const WebRequest& request) {
  std::unique_ptr<AgentSocket> socket;
  if (const auto agent_id = AgentOf(request.target, "/link")) {
    socket = std::make_unique<LinkSocket>(*this, *agent_id);
  } else if (const auto uploader = AgentOf(request.target, "/recording")) {
    socket = std::make_unique<RecordingSocket>(*this, *uploader);
  } else {
    return nullptr;
  }
  if (unproven_.size() >= kMaxUnproven) {
    unproven_.front()->End(kTooMany);
    unproven_.pop_front();
  }
  unproven_.push_back(socket.get());
  return socket;
}

bool Gateway::OnProof(AgentSocket* socket, Bytes proof) {
  unproven_.remove(socket);
  const int32_t agent_id = socket->agent_id();
  const auto agent = agents_.find(agent_id);
  // An unknown agent costs the same work, so that timing does not reveal which agents exist.
  const SecretKey key = agent == agents_.end() ? SecretKey::Random() : agent->second.key;
  const auto expected = GatewayProof(key, agent_id, socket->nonce());
  if (proof.size() == expected.size() &&
      sodium_memcmp(proof.data(), expected.data(), expected.size()) == 0) {
    return true;
  }
  socket->End(kNotKnown);
  return false;
}

bool Gateway::OnLink(LinkSocket* socket) {
  return TakePlace(socket, kMaxAgentsAtOnce, &connected_);
}

bool Gateway::OnUpload(RecordingSocket* socket) {
  return TakePlace(socket, kMaxUploads, &uploads_);
}

void Gateway::OnGone(AgentSocket* socket) {
  unproven_.remove(socket);
  std::erase_if(connected_, [&](const auto& item) { return item.second == socket; });
  std::erase_if(uploads_, [&](const auto& item) { return item.second == socket; });
}

}  // namespace pangea
