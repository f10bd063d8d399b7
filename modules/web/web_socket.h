#pragma once

// The server's end of a WebSocket, over a stream with or without TLS.

#include <boost/beast/websocket.hpp>
#include <boost/beast/websocket/ssl.hpp>
#include <string_view>
#include <utility>
#include <vector>

#include "web/web_streams.h"

namespace pangea::web {

namespace websocket = beast::websocket;

template <typename Stream>
class Socket : public AnySocket, public std::enable_shared_from_this<Socket<Stream>> {
 public:
  Socket(Stream stream, std::unique_ptr<WebPeer> peer, WebSite& site)
      : socket_(std::move(stream)), peer_(std::move(peer)), site_(site) {}

  void Open(Request request) {
    auto timeout = websocket::stream_base::timeout::suggested(beast::role_type::server);
    timeout.handshake_timeout = kAsking;  // also for the closing handshake
    timeout.idle_timeout = kSilence;
    socket_.set_option(timeout);
    socket_.read_message_max(peer_->max_message_bytes());
    socket_.text(peer_->is_text());
    request_ = std::move(request);
    socket_.async_accept(request_, [self = this->shared_from_this()](beast::error_code error) {
      self->open_ = !error;
      if (!error) {
        self->Read();
      }
    });
  }

  void SendNext() override {
    if (sending_ && Clock::now() > take_by_) {
      return CutOff();
    }
    if (!open_ || sending_) {
      return;
    }
    if (auto message = peer_->Next()) {
      return Send(std::move(*message));
    }
    if (const auto ending = peer_->Ending()) {
      Close(*ending);
    }
  }

 private:
  using Clock = std::chrono::steady_clock;

  void Send(std::vector<uint8_t> message) {
    message_ = std::move(message);
    sending_ = true;
    take_by_ = Clock::now() + kTaking;
    socket_.async_write(asio::buffer(message_),
                        [self = this->shared_from_this()](beast::error_code error, size_t) {
                          self->sending_ = false;
                          self->open_ = self->open_ && !error;
                          self->SendNext();
                        });
  }

  void Read() {
    socket_.async_read(buffer_, [self = this->shared_from_this()](beast::error_code error, size_t) {
      if (error) {
        self->OnReadError(error);
        return;
      }
      const auto data = self->buffer_.cdata();
      const bool understood =
          self->peer_->Receive({static_cast<const char*>(data.data()), data.size()});
      self->buffer_.clear();
      if (understood) {
        self->Read();
      } else {
        self->Close(
            self->peer_->Ending().value_or(WebEnding{websocket::close_code::policy_error, ""}));
      }
    });
  }

  void OnReadError(beast::error_code error) {
    if (error == beast::error::timeout && open_) {
      site_.Refused("socket: silent for 30 s");
    }
    open_ = false;
  }

  void Close(const WebEnding& ending) {
    if (std::exchange(open_, false)) {
      websocket::close_reason reason;
      reason.code = ending.code;
      reason.reason = ending.reason;
      socket_.async_close(reason, [self = this->shared_from_this()](beast::error_code) {});
    }
  }

  // Closes the connection at once, because the client has not taken a message in time.
  void CutOff() {
    site_.Refused("socket: takes nothing for 30 s");
    open_ = false;
    sending_ = false;
    beast::get_lowest_layer(socket_).close();
  }

  websocket::stream<Stream> socket_;
  const std::unique_ptr<WebPeer> peer_;
  WebSite& site_;
  Request request_;
  beast::flat_buffer buffer_;
  std::vector<uint8_t> message_;
  Clock::time_point take_by_;
  bool open_ = false;
  bool sending_ = false;
};

}  // namespace pangea::web
