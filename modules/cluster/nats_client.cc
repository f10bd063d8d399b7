#include "cluster/nats_client.h"

#include <fmt/format.h>
#include <nats/nats.h>

#include <stdexcept>

namespace pangea {
namespace {

constexpr int64_t kReconnectWait_ms = 500;
constexpr int64_t kNanosecondsPerMicrosecond = 1000;
constexpr int64_t kMaxTaken = 100'000;  // NATS' own default would stop a large cluster

struct Deleter {
  void operator()(natsConnection* connection) const { natsConnection_Destroy(connection); }
  void operator()(natsOptions* options) const { natsOptions_Destroy(options); }
  void operator()(natsSubscription* subscription) const { natsSubscription_Destroy(subscription); }
  void operator()(natsMsg* message) const { natsMsg_Destroy(message); }
  void operator()(jsCtx* context) const { jsCtx_Destroy(context); }
  void operator()(jsConsumerInfo* info) const { jsConsumerInfo_Destroy(info); }
};
template <typename T>
using Owned = std::unique_ptr<T, Deleter>;

std::vector<uint8_t> DataOf(const natsMsg* message) {
  const char* const data = natsMsg_GetData(message);
  return {data, data + natsMsg_GetDataLength(message)};
}

// JetStream's answer when it has nothing: no message, but a status.
bool IsStatus(natsMsg* message) {
  const char* status = nullptr;
  return natsMsgHeader_Get(message, "Status", &status) == NATS_OK;
}

}  // namespace

struct NatsClient::Impl {
  std::string url;
  Owned<natsOptions> options;
  Owned<natsConnection> connection;
  Owned<jsCtx> context;
  Owned<natsSubscription> heard;

  void Check(natsStatus status, jsErrCode error, const std::string& what) const {
    if (status == NATS_NO_RESPONDERS || error == JSNotEnabledErr) {
      throw std::runtime_error(fmt::format(
          "NATS at {} has no JetStream: start it with nats-server -js -sd FOLDER", url));
    }
    if (status != NATS_OK) {
      throw std::runtime_error(
          fmt::format("NATS at {}: {}: {}", url, what, nats_GetLastError(nullptr)));
    }
  }

  std::optional<Message> Get(const std::string& stream, jsDirectGetMsgOptions* which) const {
    if (natsConnection_Status(connection.get()) != NATS_CONN_STATUS_CONNECTED) {
      return std::nullopt;
    }
    natsMsg* got = nullptr;
    const natsStatus status = js_DirectGetMsg(&got, context.get(), stream.c_str(), nullptr, which);
    const Owned<natsMsg> message(got);
    if (status != NATS_OK) {
      return std::nullopt;
    }
    return Message{natsMsg_GetSubject(got), natsMsg_GetSequence(got), DataOf(got)};
  }

  void Say(const std::string& claim, const char* what) const {
    natsConnection_PublishString(connection.get(), claim.c_str(), what);
  }
};

NatsClient::NatsClient(const std::string& url, const std::string& name)
    : impl_(std::make_unique<Impl>()) {
  impl_->url = url;
  natsOptions* options = nullptr;
  natsOptions_Create(&options);
  impl_->options.reset(options);
  natsOptions_SetName(options, name.c_str());
  natsOptions_SetTimeout(options, kTimeout_ms);
  natsOptions_SetMaxReconnect(options, -1);
  natsOptions_SetReconnectWait(options, kReconnectWait_ms);
  natsConnection* connection = nullptr;
  natsStatus status = natsOptions_SetURL(options, url.c_str());
  if (status == NATS_OK) {
    status = natsConnection_Connect(&connection, options);
  }
  impl_->connection.reset(connection);
  if (status != NATS_OK) {
    throw std::runtime_error(
        fmt::format("cannot reach NATS at {}: {}; give --nats nats://HOST:4222, or start it: "
                    "nats-server -a 127.0.0.1 -js -sd FOLDER",
                    url, natsStatus_GetText(status)));
  }
  jsOptions wait{};
  jsOptions_Init(&wait);
  wait.Wait = kTimeout_ms;
  jsCtx* context = nullptr;
  status = natsConnection_JetStream(&context, connection, &wait);
  impl_->context.reset(context);
  impl_->Check(status, jsErrCode(0), "JetStream");
}

NatsClient::~NatsClient() = default;

bool NatsClient::connected() const {
  return natsConnection_Status(impl_->connection.get()) == NATS_CONN_STATUS_CONNECTED;
}

void NatsClient::MakeStream(const std::string& stream, const std::string& subjects,
                            Retention retention) {
  const char* const names[] = {subjects.c_str()};
  jsStreamConfig config{};
  jsStreamConfig_Init(&config);
  config.Name = stream.c_str();
  config.Subjects = const_cast<const char**>(names);
  config.SubjectsLen = 1;
  config.AllowDirect = true;
  config.Retention =
      retention == Retention::kUntilAcknowledged ? js_WorkQueuePolicy : js_LimitsPolicy;
  jsErrCode error{};
  const natsStatus status = js_AddStream(nullptr, impl_->context.get(), &config, nullptr, &error);
  impl_->Check(status, error, "stream " + stream);
}

void NatsClient::MakeQueue(const std::string& stream, const std::string& consumer,
                           int64_t ack_wait_us) {
  jsConsumerConfig config{};
  jsConsumerConfig_Init(&config);
  config.Durable = consumer.c_str();
  config.AckPolicy = js_AckExplicit;
  config.AckWait = kNanosecondsPerMicrosecond * ack_wait_us;
  config.MaxAckPending = kMaxTaken;
  jsErrCode error{};
  const natsStatus status =
      js_AddConsumer(nullptr, impl_->context.get(), stream.c_str(), &config, nullptr, &error);
  impl_->Check(status, error, fmt::format("queue {} of stream {}", consumer, stream));
}

NatsClient::Stored NatsClient::Store(const std::string& subject, Bytes data) {
  if (!connected()) {
    return Stored::kUnreachable;
  }
  jsPubOptions options{};
  jsPubOptions_Init(&options);
  options.ExpectNoMessage = true;
  options.MaxWait = kTimeout_ms;
  jsErrCode error{};
  const natsStatus status = js_Publish(nullptr, impl_->context.get(), subject.c_str(), data.data(),
                                       static_cast<int>(data.size()), &options, &error);
  if (status == NATS_OK) {
    return Stored::kNew;
  }
  if (status == NATS_MAX_PAYLOAD) {
    return Stored::kTooLarge;
  }
  return error == JSStreamWrongLastSequenceErr ? Stored::kWasThere : Stored::kUnreachable;
}

std::optional<NatsClient::Message> NatsClient::Find(const std::string& stream,
                                                    const std::string& subject) {
  jsDirectGetMsgOptions which{};
  jsDirectGetMsgOptions_Init(&which);
  which.LastBySubject = subject.c_str();
  return impl_->Get(stream, &which);
}

std::optional<NatsClient::Message> NatsClient::Next(const std::string& stream, uint64_t sequence,
                                                    const std::string& subjects) {
  jsDirectGetMsgOptions which{};
  jsDirectGetMsgOptions_Init(&which);
  which.Sequence = sequence;
  which.NextBySubject = subjects.c_str();
  return impl_->Get(stream, &which);
}

// libnats' own fetch leaves its request with NATS when it has waited in vain, and what answers that
// is nobody's until it is delivered again. This one is answered at once.
std::optional<NatsClient::Taken> NatsClient::Take(const std::string& stream,
                                                  const std::string& consumer) {
  if (!connected()) {
    return std::nullopt;
  }
  const std::string subject = fmt::format("$JS.API.CONSUMER.MSG.NEXT.{}.{}", stream, consumer);
  natsMsg* got = nullptr;
  const natsStatus status =
      natsConnection_RequestString(&got, impl_->connection.get(), subject.c_str(),
                                   R"({"batch": 1, "no_wait": true})", kTimeout_ms);
  const Owned<natsMsg> message(got);
  if (status != NATS_OK || IsStatus(got) || natsMsg_GetReply(got) == nullptr) {
    return std::nullopt;
  }
  return Taken{natsMsg_GetReply(got), DataOf(got)};
}

bool NatsClient::Acknowledge(const std::string& claim) {
  if (!connected()) {
    return false;
  }
  natsMsg* got = nullptr;
  const natsStatus status = natsConnection_RequestString(&got, impl_->connection.get(),
                                                         claim.c_str(), "+ACK", kTimeout_ms);
  const Owned<natsMsg> message(got);
  return status == NATS_OK;
}

void NatsClient::StillWorking(const std::string& claim) { impl_->Say(claim, "+WPI"); }

void NatsClient::GiveBack(const std::string& claim) {
  impl_->Say(claim, "-NAK");
  natsConnection_FlushTimeout(impl_->connection.get(), kTimeout_ms);
}

std::optional<NatsClient::Queue> NatsClient::LookAt(const std::string& stream,
                                                    const std::string& consumer) {
  if (!connected()) {
    return std::nullopt;
  }
  jsConsumerInfo* got = nullptr;
  const natsStatus status = js_GetConsumerInfo(&got, impl_->context.get(), stream.c_str(),
                                               consumer.c_str(), nullptr, nullptr);
  const Owned<jsConsumerInfo> info(got);
  if (status != NATS_OK) {
    return std::nullopt;
  }
  return Queue{got->NumPending, got->NumAckPending};
}

void NatsClient::Publish(const std::string& subject, Bytes data) {
  if (connected()) {
    natsConnection_Publish(impl_->connection.get(), subject.c_str(), data.data(),
                           static_cast<int>(data.size()));
  }
}

void NatsClient::Listen(const std::string& subject) {
  natsSubscription* subscription = nullptr;
  const natsStatus status =
      natsConnection_SubscribeSync(&subscription, impl_->connection.get(), subject.c_str());
  impl_->heard.reset(subscription);
  impl_->Check(status, jsErrCode(0), subject);
}

std::optional<std::vector<uint8_t>> NatsClient::NextHeard() {
  uint64_t waiting = 0;
  if (natsSubscription_QueuedMsgs(impl_->heard.get(), &waiting) != NATS_OK || waiting == 0) {
    return std::nullopt;
  }
  natsMsg* got = nullptr;
  const natsStatus status = natsSubscription_NextMsg(&got, impl_->heard.get(), 1);
  const Owned<natsMsg> message(got);
  return status == NATS_OK ? std::optional(DataOf(got)) : std::nullopt;
}

}  // namespace pangea
