#include "cluster/nats/nats_client.h"

#include <fmt/format.h>
#include <nats/nats.h>

#include <charconv>
#include <chrono>
#include <cstdlib>
#include <functional>
#include <map>
#include <sstream>
#include <stdexcept>

#include "cluster/nats/nats_connection.h"

namespace pangea {
namespace {

constexpr int64_t kRetry_ms = 500;
// For questions that are asked again anyway: a stream without a leader does not answer them, and
// the caller has more to do.
constexpr int64_t kQuestion_ms = 500;
// For a message that any replica has: the first of a few questions, which double their time. The
// host of the replica that is asked may be gone.
constexpr int64_t kFirstQuestion_ms = 100;
constexpr int64_t kLastQuestion_ms = 800;
constexpr int64_t kNanosecondsPerMicrosecond = 1000;
constexpr int64_t kMaxUnacknowledged = 100'000;  // NATS' own default would stop a large cluster
constexpr char kUtimeHeader[] = "Pangea-Utime";
constexpr char kExpectedOfStream[] = "Nats-Expected-Last-Sequence";
constexpr char kExpectedOfSubject[] = "Nats-Expected-Last-Subject-Sequence";
// How long a NATS cluster that was just started may take to elect its leader.
constexpr std::chrono::seconds kLongestChoice{20};

std::vector<uint8_t> DataOf(const natsMsg* message) {
  const char* const data = natsMsg_GetData(message);
  return {data, data + natsMsg_GetDataLength(message)};
}

jsOptions QuestionOptions(int64_t wait_ms = kQuestion_ms) {
  jsOptions options{};
  jsOptions_Init(&options);
  options.Wait = wait_ms;
  return options;
}

// Whether this is a status and not a message: JetStream's answer when it has no message.
bool IsStatus(natsMsg* message) {
  const char* status = nullptr;
  return natsMsgHeader_Get(message, "Status", &status) == NATS_OK;
}

int64_t UtimeOf(natsMsg* message) {
  const char* utime = nullptr;
  return natsMsgHeader_Get(message, kUtimeHeader, &utime) == NATS_OK ? std::atoll(utime) : 0;
}

// Whether the error may be temporary: a leader is being elected, or needed nodes are not there yet.
bool MayChange(natsStatus status, jsErrCode error) {
  return status == NATS_TIMEOUT || error == JSClusterNotAvailErr || error == JSClusterNoPeersErr ||
         error == JSInsufficientResourcesErr;
}

// The ack subject of a message contains the time when it was stored, in nanoseconds:
// $JS.ACK[.domain.account].stream.consumer.deliveries.sequence.sequence.when.pending[.token].
int64_t StoredUtime(const std::string& ack_subject) {
  constexpr size_t kWhen = 7, kWhenBehindDomain = 9, kWithDomain = 11;
  std::vector<std::string> tokens;
  std::istringstream stream(ack_subject);
  for (std::string token; std::getline(stream, token, '.');) {
    tokens.push_back(token);
  }
  const size_t when = tokens.size() < kWithDomain ? kWhen : kWhenBehindDomain;
  int64_t nanoseconds = 0;
  if (when < tokens.size()) {
    const std::string& text = tokens[when];
    std::from_chars(text.data(), text.data() + text.size(), nanoseconds);
  }
  return nanoseconds / kNanosecondsPerMicrosecond;
}

}  // namespace

struct NatsClient::Impl {
  std::string url;
  NatsOwned<natsConnection> connection;
  NatsOwned<jsCtx> context;
  std::map<std::string, NatsOwned<natsSubscription>> heard;  // by subject

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

  void Make(const std::string& what, const std::function<natsStatus(jsErrCode*)>& make) const {
    const auto end = std::chrono::steady_clock::now() + kLongestChoice;
    jsErrCode error{};
    natsStatus status = make(&error);
    while (MayChange(status, error) && std::chrono::steady_clock::now() < end) {
      nats_Sleep(kRetry_ms);
      error = {};
      status = make(&error);
    }
    Check(status, error, what);
  }

  // NATS asks one replica, and notices after half a minute that its host is gone.
  std::optional<Message> Get(const std::string& stream, jsDirectGetMsgOptions* which) const {
    if (natsConnection_Status(connection.get()) != NATS_CONN_STATUS_CONNECTED) {
      return std::nullopt;
    }
    natsMsg* got = nullptr;
    natsStatus status = NATS_TIMEOUT;
    for (int64_t wait_ms = kFirstQuestion_ms; wait_ms <= kLastQuestion_ms && status == NATS_TIMEOUT;
         wait_ms *= 2) {
      jsOptions options = QuestionOptions(wait_ms);
      status = js_DirectGetMsg(&got, context.get(), stream.c_str(), &options, which);
    }
    const NatsOwned<natsMsg> message(got);
    if (status != NATS_OK) {
      return std::nullopt;
    }
    return Message{natsMsg_GetSubject(got), natsMsg_GetSequence(got), UtimeOf(got), DataOf(got)};
  }

  void Reply(const std::string& ack_subject, const char* what) const {
    natsConnection_PublishString(connection.get(), ack_subject.c_str(), what);
  }
};

NatsClient::NatsClient(const NatsAccess& access, const std::string& name)
    : impl_(std::make_unique<Impl>()) {
  impl_->url = access.url;
  impl_->connection = ConnectToNats(access, name, kTimeout_ms);
  jsOptions wait{};
  jsOptions_Init(&wait);
  wait.Wait = kTimeout_ms;
  jsCtx* context = nullptr;
  const natsStatus status = natsConnection_JetStream(&context, impl_->connection.get(), &wait);
  impl_->context.reset(context);
  impl_->Check(status, jsErrCode(0), "JetStream");
}

NatsClient::~NatsClient() = default;

bool NatsClient::connected() const {
  return natsConnection_Status(impl_->connection.get()) == NATS_CONN_STATUS_CONNECTED;
}

void NatsClient::MakeStream(const std::string& stream, const std::string& subjects,
                            Retention retention, int replicas) {
  const char* const names[] = {subjects.c_str()};
  jsStreamInfo* got = nullptr;
  js_GetStreamInfo(&got, impl_->context.get(), stream.c_str(), nullptr, nullptr);
  const NatsOwned<jsStreamInfo> info(got);
  jsStreamConfig config{};
  jsStreamConfig_Init(&config);
  config.Name = stream.c_str();
  config.Subjects = const_cast<const char**>(names);
  config.SubjectsLen = 1;
  config.AllowDirect = true;
  config.Retention =
      retention == Retention::kUntilAcknowledged ? js_WorkQueuePolicy : js_LimitsPolicy;
  if (retention == Retention::kNewestOfSubject) {
    config.MaxMsgsPerSubject = 1;
  }
  const int64_t had = info ? info->Config->Replicas : 1;
  config.Replicas = replicas > 0 ? replicas : had;
  impl_->Make(fmt::format("stream {} with {} replicas", stream, config.Replicas),
              [&](jsErrCode* error) {
                return info && had != config.Replicas
                           ? js_UpdateStream(nullptr, impl_->context.get(), &config, nullptr, error)
                           : js_AddStream(nullptr, impl_->context.get(), &config, nullptr, error);
              });
}

void NatsClient::MakeQueue(const std::string& stream, const std::string& consumer,
                           int64_t ack_wait_us) {
  jsConsumerConfig config{};
  jsConsumerConfig_Init(&config);
  config.Durable = consumer.c_str();
  config.AckPolicy = js_AckExplicit;
  config.AckWait = kNanosecondsPerMicrosecond * ack_wait_us;
  config.MaxAckPending = kMaxUnacknowledged;
  impl_->Make(fmt::format("queue {} of stream {}", consumer, stream), [&](jsErrCode* error) {
    return js_AddConsumer(nullptr, impl_->context.get(), stream.c_str(), &config, nullptr, error);
  });
}

NatsClient::StoreAnswer NatsClient::Store(const std::string& subject, Bytes data,
                                          const If& condition, int64_t utime) {
  if (!connected()) {
    return {};
  }
  natsMsg* made = nullptr;
  natsMsg_Create(&made, subject.c_str(), nullptr, reinterpret_cast<const char*>(data.data()),
                 static_cast<int>(data.size()));
  const NatsOwned<natsMsg> message(made);
  if (utime != 0) {
    natsMsgHeader_Set(made, kUtimeHeader, std::to_string(utime).c_str());
  }
  // We set the headers ourselves, because libnats' options cannot require that there is no message.
  const bool of_stream = condition.what == If::What::kNewestOfStream;
  natsMsgHeader_Set(made, of_stream ? kExpectedOfStream : kExpectedOfSubject,
                    std::to_string(condition.sequence).c_str());
  jsPubOptions options{};
  jsPubOptions_Init(&options);
  options.MaxWait = kTimeout_ms;
  jsErrCode error{};
  jsPubAck* got = nullptr;
  const natsStatus status = js_PublishMsg(&got, impl_->context.get(), made, &options, &error);
  const NatsOwned<jsPubAck> answer(got);
  if (status == NATS_OK) {
    return {Stored::kNew, answer->Sequence};
  }
  if (status == NATS_MAX_PAYLOAD) {
    return {Stored::kTooLarge};
  }
  return {error == JSStreamWrongLastSequenceErr ? Stored::kOtherwise : Stored::kUnreachable};
}

std::optional<uint64_t> NatsClient::LastSequence(const std::string& stream) {
  if (!connected()) {
    return std::nullopt;
  }
  jsOptions options = QuestionOptions();
  jsStreamInfo* got = nullptr;
  const natsStatus status =
      js_GetStreamInfo(&got, impl_->context.get(), stream.c_str(), &options, nullptr);
  const NatsOwned<jsStreamInfo> info(got);
  return status == NATS_OK ? std::optional(info->State.LastSeq) : std::nullopt;
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

std::optional<std::vector<std::string>> NatsClient::Subjects(const std::string& stream,
                                                             const std::string& subjects) {
  if (!connected()) {
    return std::nullopt;
  }
  jsOptions options{};
  jsOptions_Init(&options);
  options.Wait = kTimeout_ms;
  options.Stream.Info.SubjectsFilter = subjects.c_str();
  jsStreamInfo* got = nullptr;
  const natsStatus status =
      js_GetStreamInfo(&got, impl_->context.get(), stream.c_str(), &options, nullptr);
  const NatsOwned<jsStreamInfo> info(got);
  if (status != NATS_OK) {
    return std::nullopt;
  }
  std::vector<std::string> found;
  for (int i = 0; info->State.Subjects != nullptr && i < info->State.Subjects->Count; ++i) {
    found.emplace_back(info->State.Subjects->List[i].Subject);
  }
  return found;
}

// If libnats' own fetch times out, its request stays with NATS; a message sent to it later would be
// lost until it is delivered again. This request is answered at once.
std::optional<NatsClient::Delivery> NatsClient::Fetch(const std::string& stream,
                                                      const std::string& consumer) {
  if (!connected()) {
    return std::nullopt;
  }
  const std::string subject = fmt::format("$JS.API.CONSUMER.MSG.NEXT.{}.{}", stream, consumer);
  natsMsg* got = nullptr;
  const natsStatus status =
      natsConnection_RequestString(&got, impl_->connection.get(), subject.c_str(),
                                   R"({"batch": 1, "no_wait": true})", kTimeout_ms);
  const NatsOwned<natsMsg> message(got);
  if (status != NATS_OK || IsStatus(got) || natsMsg_GetReply(got) == nullptr) {
    return std::nullopt;
  }
  const std::string ack_subject = natsMsg_GetReply(got);
  return Delivery{ack_subject, StoredUtime(ack_subject), DataOf(got)};
}

bool NatsClient::Acknowledge(const std::string& ack_subject) {
  if (!connected()) {
    return false;
  }
  natsMsg* got = nullptr;
  const natsStatus status = natsConnection_RequestString(&got, impl_->connection.get(),
                                                         ack_subject.c_str(), "+ACK", kTimeout_ms);
  const NatsOwned<natsMsg> message(got);
  return status == NATS_OK;
}

void NatsClient::InProgress(const std::string& ack_subject) { impl_->Reply(ack_subject, "+WPI"); }

void NatsClient::Nak(const std::string& ack_subject, int64_t delay_us) {
  const std::string nak =
      fmt::format(R"(-NAK {{"delay": {}}})", kNanosecondsPerMicrosecond * delay_us);
  impl_->Reply(ack_subject, nak.c_str());
  natsConnection_FlushTimeout(impl_->connection.get(), kTimeout_ms);
}

std::optional<NatsClient::QueueState> NatsClient::StateOf(const std::string& stream,
                                                          const std::string& consumer) {
  if (!connected()) {
    return std::nullopt;
  }
  jsOptions options = QuestionOptions();
  jsConsumerInfo* got = nullptr;
  const natsStatus status = js_GetConsumerInfo(&got, impl_->context.get(), stream.c_str(),
                                               consumer.c_str(), &options, nullptr);
  const NatsOwned<jsConsumerInfo> info(got);
  if (status != NATS_OK) {
    return std::nullopt;
  }
  return QueueState{got->NumPending, got->NumAckPending};
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
  impl_->heard[subject].reset(subscription);
  impl_->Check(status, jsErrCode(0), subject);
}

std::optional<NatsClient::Heard> NatsClient::NextHeard(const std::string& subject) {
  natsSubscription* const heard = impl_->heard.at(subject).get();
  uint64_t waiting = 0;
  if (natsSubscription_QueuedMsgs(heard, &waiting) != NATS_OK || waiting == 0) {
    return std::nullopt;
  }
  natsMsg* got = nullptr;
  const natsStatus status = natsSubscription_NextMsg(&got, heard, 1);
  const NatsOwned<natsMsg> message(got);
  return status == NATS_OK ? std::optional(Heard{natsMsg_GetSubject(got), DataOf(got)})
                           : std::nullopt;
}

}  // namespace pangea
