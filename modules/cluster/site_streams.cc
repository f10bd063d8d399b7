#include "cluster/site_streams.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <stdexcept>
#include <utility>

#include "messages/messages.h"

namespace pangea {
namespace {

constexpr char kKeyframe[] = "keyframe";
constexpr char kMatch[] = "match";
constexpr char kResult[] = "result";
constexpr char kWorkers[] = "workers";
constexpr size_t kMaxSiteName = 40;

// It becomes part of subjects and of names of streams.
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

std::string Tokens(const MapId& map) {
  return fmt::format("{}.{}", map.agent_id, map.opened_utime);
}

}  // namespace

SiteStreams::SiteStreams(const std::string& nats_url, const std::string& site, int64_t ack_wait_us)
    : site_(CheckedSite(site)), nats_(nats_url, "pangea-bridge " + site) {
  for (const char* kind : {kKeyframe, kMatch, kResult}) {
    nats_.MakeStream(
        Stream(kind), Subject(kind, ">"),
        kind == kMatch ? NatsClient::Retention::kUntilAcknowledged : NatsClient::Retention::kKept);
  }
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

SiteStreams::Entry SiteStreams::EntryOf(const Keyframe& keyframe) const {
  return {Subject(kKeyframe, keyframe.id), EncodeMessage(ToMessage(keyframe))};
}

SiteStreams::Entry SiteStreams::EntryOf(const PlaceMatch& match) const {
  return {Subject(kMatch, match.query), EncodeMessage(ToMessage(match))};
}

SiteStreams::Entry SiteStreams::EntryOf(const Constraint& result) const {
  return {fmt::format("{}.{}", Subject(kResult, result.to), result.Id()),
          EncodeMessage(ToMessage(result))};
}

std::optional<SiteStreams::Message> SiteStreams::FindKeyframe(const KeyframeId& id) {
  return nats_.Find(Stream(kKeyframe), Subject(kKeyframe, id));
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
  return {nats_, Stream(kKeyframe), Subject(kKeyframe, ">")};
}

SiteStreams::Reader SiteStreams::Results() {
  return {nats_, Stream(kResult), Subject(kResult, ">")};
}

SiteStreams::Reader SiteStreams::ResultsOf(const MapId& map) {
  return {nats_, Stream(kResult), Subject(kResult, Tokens(map) + ".>")};
}

std::optional<SiteStreams::Taken> SiteStreams::TakeMatch() {
  return nats_.Take(Stream(kMatch), kWorkers);
}

std::optional<SiteStreams::Queue> SiteStreams::LookAtQueue() {
  return nats_.LookAt(Stream(kMatch), kWorkers);
}

void SiteStreams::PublishHave(Bytes data) { nats_.Publish(HaveSubject(), data); }

void SiteStreams::ListenToHave() { nats_.Listen(HaveSubject()); }

}  // namespace pangea
