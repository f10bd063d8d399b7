// The bytes of a connection from the network (HTTP requests and WebSocket frames) to the gateway's
// web server without TLS.

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include "fuzz.h"
#include "gateway/gateway.h"
#include "link/agent_key.h"
#include "web/web_server.h"

namespace pangea::fuzz {
namespace {

constexpr int kMaxRounds = 50;  // of 1 ms, until the server has answered

class NoRecordings : public RecordingStore {
 public:
  std::string Begin(int32_t, int64_t) override { return Unreachable(); }
  std::string Write(int32_t, Bytes) override { return Unreachable(); }
  Kept Finish(int32_t) override { return {"", Unreachable()}; }
  void Abort(int32_t) override {}

 private:
  static std::string Unreachable() {
    Require(false, "nobody guesses a proof");
    return "";
  }
};

class Server {
 public:
  Server()
      : gateway_({"hall", "pangea", PageOf("<p>page"), "authority"},
                 {[](const JoinRequest&) {
                    return JoinResult{JoinResult::kWrongCode, "no", 0, ""};
                  },
                  [](int32_t, Bytes) { Require(false, "nobody guesses a proof"); },
                  [](const std::string& why) { Require(!why.empty(), "a refusal has a reason"); },
                  [] {}},
                 recordings_),
        server_({"127.0.0.1", 0, {}, true}, gateway_) {
    gateway_.SetAgents({{7, {SecretKey::Random(), "Anna"}}});
  }

  void Take(Bytes bytes) {
    gateway_.SetNow(now_us_ += 1'000'000);
    const int fd = Connect();
    // It is no error if the server has closed the connection before it has read all bytes.
    (void)!send(fd, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    shutdown(fd, SHUT_WR);
    bool is_over = false;
    for (int round = 0; round < kMaxRounds && !is_over; ++round) {
      server_.Serve(round == 0 ? 0 : 1);
      char answer[4096];
      ssize_t got = 0;
      while ((got = recv(fd, answer, sizeof(answer), MSG_DONTWAIT)) > 0) {
      }
      is_over = got == 0 || errno != EAGAIN;
    }
    Require(is_over, "who has no more to say is let go");
    close(fd);
    server_.Serve(0);
  }

 private:
  static web::Page PageOf(const std::string& text) {
    return {{"/", {"text/html", std::make_shared<const std::string>(text), nullptr}}};
  }
  int Connect() const {
    const int fd = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(server_.port());
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    Require(connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) == 0,
            "the server listens");
    // A closed port must not wait for last packets: many connections follow one another.
    const linger none{1, 0};
    setsockopt(fd, SOL_SOCKET, SO_LINGER, &none, sizeof(none));
    return fd;
  }

  NoRecordings recordings_;
  Gateway gateway_;
  web::WebServer server_;
  int64_t now_us_ = 0;
};

}  // namespace
}  // namespace pangea::fuzz

static int FuzzWeb(const uint8_t* data, size_t size) {
  static pangea::fuzz::Server server;
  server.Take({data, size});
  return 0;
}
static const pangea::fuzz::Target kWeb("web", FuzzWeb);
