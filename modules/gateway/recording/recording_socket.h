#pragma once

// Upload of a recording by a page over a WebSocket. After the proof (integers are little-endian):
//
//   up    uint64 size of the zip; then its bytes, in messages of at most kMaxMessage
//   down  uint64 number of bytes taken so far, first 0. The page may send at most kWindow bytes
//         beyond it. When all bytes are kept, the socket is closed with kKept and the file's name;
//         otherwise with the reason.
//
// Bounds: kMaxRecording bytes; kRate_bytes_per_s, at which the number of bytes taken grows at most;
// kStalled_us without a byte.

#include <string>

#include "gateway/agent_socket.h"
#include "link/pacer.h"

namespace pangea {

// Keeps recordings; an agent uploads one at a time. Errors are texts for the visitor; an empty text
// means no error.
class RecordingStore {
 public:
  struct Kept {
    std::string file;  // name of the file
    std::string error;
  };
  virtual ~RecordingStore() = default;
  virtual std::string Begin(int32_t agent_id, int64_t bytes) = 0;
  virtual std::string Write(int32_t agent_id, Bytes data) = 0;
  virtual Kept Finish(int32_t agent_id) = 0;
  // Removes the agent's unfinished upload, if there is one.
  virtual void Abort(int32_t agent_id) = 0;
};

class RecordingSocket;

class RecordingSocketOwner : public AgentSocketOwner {
 public:
  // Makes this socket the agent's upload. False if the socket has been ended instead.
  virtual bool OnUpload(RecordingSocket* socket) = 0;
  virtual RecordingStore& recordings() = 0;
};

class RecordingSocket : public AgentSocket {
 public:
  static constexpr int64_t kMaxRecording = 2'000'000'000;  // bytes: 10 minutes of images as JPEG
  static constexpr size_t kMaxMessage = 64'000;
  static constexpr int64_t kWindow = 1'000'000;
  static constexpr double kRate_bytes_per_s = 8e6;
  static constexpr int64_t kStalled_us = 30'000'000;
  static constexpr uint16_t kKept = 4200, kMalformed = 4400, kNotTaken = 4413;

  RecordingSocket(RecordingSocketOwner& owner, int32_t agent_id)
      : AgentSocket(owner, agent_id), owner_(owner) {}
  ~RecordingSocket() override;

  void End(const web::WebEnding& ending) override;
  size_t max_message_bytes() const override { return kMaxMessage; }

 private:
  bool Begin() override;
  std::optional<std::vector<uint8_t>> NextMessage() override;
  bool ReceiveMessage(Bytes message) override;
  bool TakeSize(Bytes message);
  bool TakeBytes(Bytes message);
  bool Refuse(uint16_t code, const std::string& why);
  void Abort();

  RecordingSocketOwner& owner_;
  int64_t size_ = 0;        // 0: not received yet
  int64_t received_ = 0;    // bytes received
  int64_t told_ = -1;       // bytes taken, as last sent to the page; -1: nothing was sent
  bool is_stored_ = false;  // the store has an unfinished upload
  int64_t last_us_ = 0;     // when the last message came
  Pacer rate_{kRate_bytes_per_s, static_cast<double>(kWindow)};
};

}  // namespace pangea
