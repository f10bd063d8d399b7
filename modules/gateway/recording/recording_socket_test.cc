#include "gateway/recording/recording_socket.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>

namespace pangea {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

constexpr int32_t kAgent = 7;

class FakeStore : public RecordingStore {
 public:
  std::string Begin(int32_t, int64_t bytes) override {
    announced = bytes;
    return refusal;
  }
  std::string Write(int32_t, Bytes data) override {
    written.append(data.begin(), data.end());
    return "";
  }
  Kept Finish(int32_t) override { return {"walk.zip", ""}; }
  void Abort(int32_t) override { written.clear(); }

  std::string refusal, written;
  int64_t announced = 0;
};

class RecordingSocketTest : public testing::Test, public RecordingSocketOwner {
 protected:
  bool OnProof(AgentSocket*, Bytes proof) override { return !proof.empty(); }
  bool OnUpload(RecordingSocket*) override { return true; }
  void OnRefused(const std::string& why) override { refused_ = why; }
  void OnGone(AgentSocket*) override {}
  int64_t now_us() const override { return now_us_; }
  RecordingStore& recordings() override { return store_; }

  static std::string Integer(int64_t value) {
    std::string bytes;
    for (int i = 0; i < 8; ++i) {
      bytes += static_cast<char>(static_cast<uint64_t>(value) >> (8 * i));
    }
    return bytes;
  }
  static std::string Zip(size_t size) { return "PK\x03\x04" + std::string(size - 4, 'z'); }
  // The number of bytes that the socket reports as stored; -1: no new report.
  int64_t Taken() {
    const auto message = socket_->Next();
    int64_t value = message ? 0 : -1;
    for (size_t i = 0; message && i < message->size(); ++i) {
      value |= static_cast<int64_t>((*message)[i]) << (8 * i);
    }
    return value;
  }
  void Begin(int64_t size) {
    ASSERT_TRUE(socket_->Next().has_value()) << "the nonce";
    ASSERT_TRUE(socket_->Receive("proof"));
    EXPECT_EQ(Taken(), -1) << "no size is known";
    ASSERT_TRUE(socket_->Receive(Integer(size)));
    EXPECT_EQ(Taken(), 0);
  }
  int Code() const { return socket_->Ending() ? socket_->Ending()->code : 0; }

  FakeStore store_;
  std::string refused_;
  int64_t now_us_ = 1'000'000;
  std::unique_ptr<RecordingSocket> socket_ = std::make_unique<RecordingSocket>(*this, kAgent);
};

TEST_F(RecordingSocketTest, TakesAZipAndTellsItsName) {
  Begin(100);
  EXPECT_EQ(store_.announced, 100);
  EXPECT_TRUE(socket_->Receive(Zip(60)));
  EXPECT_EQ(Taken(), 60);
  EXPECT_EQ(Taken(), -1);
  EXPECT_TRUE(socket_->Receive(std::string(40, 'z')));
  EXPECT_EQ(Code(), RecordingSocket::kKept);
  EXPECT_EQ(socket_->Ending()->reason, "walk.zip");
  socket_.reset();
  EXPECT_EQ(store_.written, Zip(100)) << "what is kept is not forgotten";
  EXPECT_THAT(refused_, IsEmpty());
}

TEST_F(RecordingSocketTest, RefusesWhatIsTooLargeOrHasNoRoom) {
  socket_->Receive("proof");
  EXPECT_FALSE(socket_->Receive(Integer(RecordingSocket::kMaxRecording + 1)));
  EXPECT_EQ(Code(), RecordingSocket::kNotTaken);
  EXPECT_THAT(refused_, HasSubstr("2000 MB at most"));

  socket_ = std::make_unique<RecordingSocket>(*this, kAgent);
  store_.refusal = "no room";
  socket_->Receive("proof");
  EXPECT_FALSE(socket_->Receive(Integer(10)));
  EXPECT_EQ(socket_->Ending()->reason, "no room");
}

TEST_F(RecordingSocketTest, RefusesWhatIsNoRecording) {
  for (const std::string& size : {Integer(0), Integer(-1), std::string("12"), std::string()}) {
    socket_ = std::make_unique<RecordingSocket>(*this, kAgent);
    socket_->Receive("proof");
    EXPECT_FALSE(socket_->Receive(size));
    EXPECT_THAT(store_.announced, 0);
  }
  for (const std::string& data : {std::string("no zip"), Zip(101), std::string()}) {
    socket_ = std::make_unique<RecordingSocket>(*this, kAgent);
    Begin(100);
    EXPECT_FALSE(socket_->Receive(data));
    EXPECT_EQ(Code(), RecordingSocket::kMalformed);
    EXPECT_THAT(store_.written, IsEmpty());
  }
}

TEST_F(RecordingSocketTest, WhatIsNotFinishedIsForgotten) {
  Begin(100);
  socket_->Receive(Zip(60));
  socket_.reset();
  EXPECT_THAT(store_.written, IsEmpty());
}

TEST_F(RecordingSocketTest, WhoStallsIsToldToGo) {
  Begin(100);
  now_us_ += RecordingSocket::kStalled_us;
  EXPECT_EQ(Taken(), -1);
  EXPECT_EQ(Code(), 0);
  EXPECT_TRUE(socket_->Receive(Zip(60)));
  now_us_ += RecordingSocket::kStalled_us + 1;
  EXPECT_EQ(Taken(), -1);
  EXPECT_EQ(Code(), RecordingSocket::kMalformed);
  EXPECT_THAT(store_.written, IsEmpty());
}

TEST_F(RecordingSocketTest, SaysNoFasterThanItsRateWhatIsTaken) {
  constexpr int64_t kSize = 40'000'000;
  Begin(kSize);
  const std::string message(50'000, 'z');
  int64_t taken = 0;
  int64_t sent = 0;
  const int64_t began_us = now_us_;
  while (sent < kSize) {
    while (sent < kSize && sent + 50'000 <= taken + RecordingSocket::kWindow) {
      ASSERT_TRUE(socket_->Receive(sent == 0 ? Zip(50'000) : message));
      sent += 50'000;
    }
    now_us_ += 10'000;
    taken = std::max(taken, Taken());
  }
  const double seconds = 1e-6 * static_cast<double>(now_us_ - began_us);
  EXPECT_NEAR(seconds, kSize / RecordingSocket::kRate_bytes_per_s, 0.5);
}

TEST_F(RecordingSocketTest, WhoSendsBeyondTheWindowIsToldToGo) {
  Begin(10'000'000);
  EXPECT_TRUE(socket_->Receive(Zip(static_cast<size_t>(RecordingSocket::kWindow))));
  EXPECT_FALSE(socket_->Receive("z"));
  EXPECT_EQ(Code(), RecordingSocket::kMalformed);
}

}  // namespace
}  // namespace pangea
