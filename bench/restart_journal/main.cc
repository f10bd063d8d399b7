// Makes a journal with a given number of keyframes from a recorded one: its maps are repeated with
// new ids, as if agents had walked there on further days. Each time different bits of every
// descriptor are flipped, like another visit of the place. Place matches and verification results
// are copied; the constraints that fuse two maps of a visit are also copied between one of them and
// the other map of the previous visit, so that everything is one group.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <map>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "core/descriptor.h"
#include "log_file/log_reader.h"
#include "messages/channels.h"
#include "messages/encoding.h"
#include "messages/messages.h"
#include "site/journal_writer.h"

namespace pangea::bench {
namespace {

constexpr int kFlippedBits = 20;                   // of 256
constexpr int64_t kVisit_us = 24 * 3'600'000'000;  // from one visit to the next

struct Event {
  int64_t utime = 0;
  std::string channel;
  std::vector<uint8_t> data;
};

template <typename Message>
Message Decoded(const Event& event) {
  Message message{};
  if (!DecodeMessage(event.data, &message)) {
    throw std::runtime_error(fmt::format("{} does not decode", event.channel));
  }
  return message;
}

template <typename Message>
auto Parsed(const Event& event) {
  auto parsed = Parse(Decoded<Message>(event));
  if (!parsed.value) {
    throw std::runtime_error(fmt::format("{}: {}", event.channel, parsed.refused));
  }
  return *std::move(parsed.value);
}

KeyframeId At(int visit, KeyframeId id) {
  id.map.opened_utime += visit * kVisit_us;
  return id;
}

class Visits {
 public:
  Visits(const std::string& log, const std::string& out) : writer_(out) {
    ReadLog(log, [this](const LogEvent& event) {
      const bool wanted = event.channel.starts_with(channels::kKeyframePrefix) ||
                          event.channel == channels::kPlaceMatch ||
                          event.channel == channels::kConstraint;
      if (wanted) {
        events_.push_back({event.utime, event.channel, {event.data.begin(), event.data.end()}});
      }
    });
    for (const Event& event : events_) {
      if (event.channel == channels::kConstraint) {
        const auto constraint = Parsed<constraint_t>(event);
        if (constraint.accepted && constraint.kind == PlaceKind::kInter) {
          fusing_.emplace(constraint.from, constraint.to);
        }
      }
    }
  }

  int64_t num_keyframes() const { return num_keyframes_; }

  // Adds as much of the visit as max_keyframes allows.
  void Add(int visit, int64_t max_keyframes) {
    for (const Event& event : events_) {
      if (event.channel == channels::kPlaceMatch) {
        AddMatch(visit, event);
      } else if (event.channel == channels::kConstraint) {
        AddConstraint(visit, event);
      } else if (num_keyframes_ < max_keyframes) {
        AddKeyframe(visit, event);
      } else {
        break;
      }
    }
    writer_.Finish();
  }

 private:
  template <typename Message>
  void Write(int visit, const Event& event, const Message& message) {
    writer_.Write(event.utime + visit * kVisit_us, event.channel, EncodeMessage(message));
  }

  void AddKeyframe(int visit, const Event& event) {
    auto message = Decoded<KeyframeMessage>(event);
    message.id = ToMessage(At(visit, *Parse(message.id).value));
    std::mt19937_64 rng(num_keyframes_++);
    for (int corner = 0; corner < message.num_corners; ++corner) {
      for (int i = 0; visit > 0 && i < kFlippedBits; ++i) {
        const uint64_t bit = rng() % kDescriptorBits;
        message.descriptors[corner * kDescriptorBits / 8 + bit / 8] ^= 1 << (bit % 8);
      }
    }
    Write(visit, event, message);
  }

  void AddMatch(int visit, const Event& event) {
    auto match = Parsed<place_match_t>(event);
    const std::vector<PlaceCandidate> candidates = std::exchange(match.candidates, {});
    for (PlaceCandidate candidate : candidates) {
      const KeyframeId place = candidate.match;
      candidate.match = At(visit, place);
      match.candidates.push_back(candidate);
      if (visit > 0 && fusing_.contains({place, match.query})) {
        candidate.match = At(visit - 1, place);
        match.candidates.push_back(candidate);
      }
    }
    match.query = At(visit, match.query);
    Write(visit, event, ToMessage(match));
  }

  void AddConstraint(int visit, const Event& event) {
    auto constraint = Parsed<constraint_t>(event);
    const KeyframeId from = constraint.from, to = constraint.to;
    constraint.to = At(visit, to);
    constraint.from = At(visit, from);
    Write(visit, event, ToMessage(constraint));
    if (visit > 0 && fusing_.contains({from, to})) {
      constraint.from = At(visit - 1, from);
      Write(visit, event, ToMessage(constraint));
    }
  }

  site::JournalWriter writer_;
  std::vector<Event> events_;
  std::set<std::pair<KeyframeId, KeyframeId>> fusing_;  // (from, to) of accepted constraints
  int64_t num_keyframes_ = 0;
};

int Run(const std::string& log, const std::string& out, int64_t num_keyframes) {
  Visits visits(log, out);
  for (int visit = 0; visits.num_keyframes() < num_keyframes; ++visit) {
    const int64_t before = visits.num_keyframes();
    visits.Add(visit, num_keyframes);
    if (visits.num_keyframes() == before) {
      throw std::runtime_error(fmt::format("{} has no keyframe", log));
    }
  }
  return 0;
}

}  // namespace
}  // namespace pangea::bench

int main(int argc, char** argv) {
  CLI::App app("Makes a journal of so many keyframes of a recorded one", "pangea-restart-journal");
  std::string log, out;
  int64_t keyframes = 0;
  app.add_option("log", log, "LCM log with keyframes, matches and verification results")
      ->required();
  app.add_option("--out", out, "the journal to make")->required();
  app.add_option("--keyframes", keyframes, "of it")->required();
  CLI11_PARSE(app, argc, argv);
  try {
    return pangea::bench::Run(log, out, keyframes);
  } catch (const std::exception& error) {
    fmt::print(stderr, "pangea-restart-journal: {}\n", error.what());
    return 1;
  }
}
