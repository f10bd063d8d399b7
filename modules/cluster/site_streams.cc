#include "cluster/site_streams.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <stdexcept>
#include <utility>

#include "messages/channels.h"
#include "messages/encoding.h"
#include "messages/messages.h"

namespace pangea {
namespace {

constexpr char kJournal[] = "journal";
constexpr char kMatch[] = "match";
constexpr char kResult[] = "result";
constexpr char kLease[] = "lease";
constexpr char kTerm[] = "term";  // used like a channel; real channels have capital letters
constexpr char kWorkers[] = "workers";
constexpr size_t kMaxSiteName = 40;

}  // namespace

std::string CheckedSite(const std::string& site) {
  const bool good = !site.empty() && site.size() <= kMaxSiteName &&
                    std::ranges::all_of(site, [](unsigned char c) {
                      return std::isalnum(c) != 0 || c == '_' || c == '-';
                    });
  if (!good) {
    throw std::runtime_error(fmt::format(
        "--site {}: give a name of letters, digits, - and _, at most {}", site, kMaxSiteName));
  }
  return site;
}

namespace {

// The end of a keyframe's subject, after "journal.": the channel, opened_utime and seq.
std::string KeyframeTokens(const KeyframeId& id) {
  return fmt::format("{}.{}.{}", channels::Keyframe(id.map.agent_id), id.map.opened_utime, id.seq);
}

std::string TokensOf(const std::string& channel, Bytes data) {
  if (!channel.starts_with(channels::kKeyframePrefix)) {
    return channel;
  }
  const auto keyframe = ParseMessage<KeyframeMessage>(data);
  return keyframe.value ? KeyframeTokens(keyframe.value->id) : channel;
}

std::string Tokens(const MapId& map) {
  return fmt::format("{}.{}", map.agent_id, map.opened_utime);
}

}  // namespace

SiteStreams::SiteStreams(const NatsAccess& access, const std::string& site)
    : site_(CheckedSite(site)), nats_(access, "pangea-bridge " + site) {}

void SiteStreams::Make(int replicas, int64_t ack_wait_us) {
  using Retention = NatsClient::Retention;
  nats_.MakeStream(Stream(kJournal), Subject(kJournal, ">"), Retention::kKept, replicas);
  nats_.MakeStream(Stream(kResult), Subject(kResult, ">"), Retention::kKept, replicas);
  nats_.MakeStream(Stream(kLease), LeaseSubject(), Retention::kNewestOfSubject, replicas);
  nats_.MakeStream(Stream(kMatch), Subject(kMatch, ">"), Retention::kUntilAcknowledged, replicas);
  nats_.MakeQueue(Stream(kMatch), kWorkers, ack_wait_us);
}

std::string SiteStreams::Stream(const std::string& kind) const {
  return fmt::format("pangea-{}-{}", site_, kind);
}

std::string SiteStreams::Subject(const std::string& kind, const std::string& rest) const {
  return fmt::format("pangea.{}.{}.{}", site_, kind, rest);
}

std::string SiteStreams::Subject(const std::string& kind, const KeyframeId& id) const {
  return Subject(kind, fmt::format("{}.{}", Tokens(id.map), id.seq));
}

std::string SiteStreams::HaveSubject() const { return fmt::format("pangea.{}.have", site_); }

std::string SiteStreams::LeaseSubject() const { return fmt::format("pangea.{}.lease", site_); }

std::string SiteStreams::SignSubject() const { return fmt::format("pangea.{}.alive", site_); }

std::string SiteStreams::StoredSubject(Kind kind) const {
  const char* const name = kind == Kind::kKeyframe ? "keyframe"
                           : kind == Kind::kMatch  ? kMatch
                                                   : kResult;
  return fmt::format("pangea.{}.stored.{}", site_, name);
}

std::string SiteStreams::OptionsSubject(const std::string& process) const {
  return fmt::format("pangea.{}.options.{}", site_, process);
}

SiteStreams::Entry SiteStreams::EntryOf(const PlaceMatch& match) const {
  return {Kind::kMatch, Subject(kMatch, match.query), EncodeMessage(ToMessage(match))};
}

SiteStreams::Entry SiteStreams::EntryOf(const Constraint& result) const {
  return {Kind::kResult, fmt::format("{}.{}", Subject(kResult, result.to), result.Id()),
          EncodeMessage(ToMessage(result))};
}

SiteStreams::Stored SiteStreams::Store(const Entry& entry) {
  const Stored stored = nats_.Store(entry.subject, entry.data, {}).stored;
  if (stored == Stored::kNew) {
    nats_.Publish(StoredSubject(entry.kind), {});
  }
  return stored;
}

SiteStreams::StoreAnswer SiteStreams::StoreEvent(const std::string& channel, int64_t utime,
                                                 Bytes data, uint64_t behind) {
  const StoreAnswer answer = nats_.Store(Subject(kJournal, TokensOf(channel, data)), data,
                                         {NatsClient::If::What::kNewestOfStream, behind}, utime);
  if (answer.stored == Stored::kNew && channel.starts_with(channels::kKeyframePrefix)) {
    nats_.Publish(StoredSubject(Kind::kKeyframe), {});
  }
  return answer;
}

SiteStreams::StoreAnswer SiteStreams::StoreTerm(uint64_t term, uint64_t behind) {
  const std::string text = std::to_string(term);
  return nats_.Store(Subject(kJournal, kTerm),
                     {reinterpret_cast<const uint8_t*>(text.data()), text.size()},
                     {NatsClient::If::What::kNewestOfStream, behind});
}

std::optional<SiteStreams::JournalEvent> SiteStreams::EventAt(uint64_t sequence) {
  auto message = nats_.Next(Stream(kJournal), sequence, Subject(kJournal, ">"));
  if (!message) {
    return std::nullopt;
  }
  if (message->sequence != sequence) {
    throw std::runtime_error(
        fmt::format("stream {}: message {} is not there any more: delete the "
                    "stream, and the journal fills it anew",
                    Stream(kJournal), sequence));
  }
  const size_t begin = Subject(kJournal, "").size();
  JournalEvent event;
  event.channel = message->subject.substr(begin, message->subject.find('.', begin) - begin);
  if (event.channel == kTerm) {
    event.term = std::stoull(std::string(message->data.begin(), message->data.end()));
  }
  event.utime = message->utime;
  event.data = std::move(message->data);
  return event;
}

std::optional<SiteStreams::Message> SiteStreams::FindLease() {
  return nats_.Find(Stream(kLease), LeaseSubject());
}

SiteStreams::StoreAnswer SiteStreams::StoreLease(const std::string& record, uint64_t behind) {
  return nats_.Store(LeaseSubject(),
                     {reinterpret_cast<const uint8_t*>(record.data()), record.size()},
                     {NatsClient::If::What::kNewestOfStream, behind});
}

void SiteStreams::PublishSign(const std::string& holder) {
  nats_.Publish(SignSubject(), {reinterpret_cast<const uint8_t*>(holder.data()), holder.size()});
}

std::optional<std::string> SiteStreams::NextSign() {
  const auto heard = nats_.NextHeard(SignSubject());
  return heard ? std::optional(std::string(heard->data.begin(), heard->data.end())) : std::nullopt;
}

std::optional<SiteStreams::Message> SiteStreams::FindKeyframe(const KeyframeId& id) {
  return nats_.Find(Stream(kJournal), Subject(kJournal, KeyframeTokens(id)));
}

std::optional<SiteStreams::Message> SiteStreams::FindMatch(const KeyframeId& query) {
  return nats_.Find(Stream(kMatch), Subject(kMatch, query));
}

std::optional<SiteStreams::Message> SiteStreams::FindResult(const KeyframeId& query,
                                                            int64_t constraint_id) {
  return nats_.Find(Stream(kResult), fmt::format("{}.{}", Subject(kResult, query), constraint_id));
}

std::optional<SiteStreams::Message> SiteStreams::Reader::Next() {
  std::optional<Message> message = nats_->Next(stream_, next_, subjects_);
  if (message) {
    next_ = message->sequence + 1;
  }
  return message;
}

SiteStreams::Reader SiteStreams::Keyframes() {
  return {nats_, Stream(kJournal), Subject(kJournal, "*.*.*")};
}

SiteStreams::Reader SiteStreams::Results() {
  return {nats_, Stream(kResult), Subject(kResult, ">")};
}

SiteStreams::Reader SiteStreams::ResultsOf(const MapId& map) {
  return {nats_, Stream(kResult), Subject(kResult, Tokens(map) + ".>")};
}

std::optional<SiteStreams::Delivery> SiteStreams::FetchMatch() {
  return nats_.Fetch(Stream(kMatch), kWorkers);
}

std::optional<std::vector<KeyframeId>> SiteStreams::PendingMatchesOf(const MapId& map) {
  const auto subjects = nats_.Subjects(Stream(kMatch), Subject(kMatch, Tokens(map) + ".*"));
  if (!subjects) {
    return std::nullopt;
  }
  std::vector<KeyframeId> pending;
  for (const std::string& subject : *subjects) {
    pending.push_back({map, std::stoi(subject.substr(subject.rfind('.') + 1))});
  }
  return pending;
}

std::optional<SiteStreams::QueueState> SiteStreams::MatchQueueState() {
  return nats_.StateOf(Stream(kMatch), kWorkers);
}

void SiteStreams::Nak(const std::string& ack_subject, int64_t delay_us) {
  nats_.Nak(ack_subject, delay_us);
  if (delay_us == 0) {
    nats_.Publish(StoredSubject(Kind::kMatch), {});  // another worker can fetch it
  }
}

bool SiteStreams::HeardOfStored(Kind kind) {
  bool heard = false;
  while (nats_.NextHeard(StoredSubject(kind))) {
    heard = true;
  }
  return heard;
}

void SiteStreams::PublishHave(Bytes data) { nats_.Publish(HaveSubject(), data); }

void SiteStreams::ListenToHave() { nats_.Listen(HaveSubject()); }

void SiteStreams::PublishOptions(const std::string& process, Bytes data) {
  nats_.Publish(OptionsSubject(process), data);
}

void SiteStreams::ListenToOptions() { nats_.Listen(OptionsSubject("*")); }

}  // namespace pangea
