#include "site/thinned_journal.h"

#include <algorithm>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "files/scratch_file.h"
#include "messages/anchor_messages.h"
#include "messages/channels.h"
#include "messages/encoding.h"
#include "messages/messages.h"
#include "server_options/server_options.h"

namespace pangea::site {
namespace {

bool IsKeyframe(const LogEvent& event) {
  return event.channel.starts_with(channels::kKeyframePrefix);
}

template <typename Message>
void WriteMessage(int64_t utime, const std::string& channel, const Message& message,
                  const ThinnedJournal::Write& write) {
  const std::vector<uint8_t> data = EncodeMessage(message);
  write({.utime = utime, .channel = channel, .data = data});
}

void Take(const LogEvent& event, Thinning* thinning) {
  const auto take = [thinning](const auto& parsed) {
    if (parsed) {
      thinning->Take(*parsed);
    }
  };
  if (IsKeyframe(event)) {
    if (const auto keyframe = ParseMessage<KeyframeMessage>(event.data).value) {
      thinning->Take(*keyframe, event.utime);
    }
  } else if (event.channel == channels::kConstraint) {
    take(ParseMessage<constraint_t>(event.data).value);
  } else if (event.channel == channels::kAnchorEdit) {
    take(ParseMessage<anchor_edit_t>(event.data).value);
  }
}

}  // namespace

ThinnedJournal Thin(const std::filesystem::path& journal, const ThinJournal& how) {
  LogReadings readings;
  const ServerOptions options = ReadLoggedOptions({journal}, &readings).options;
  Thinning thinning({how.options, options.posegraph}, std::make_shared<ScratchFile>());
  ReadLog(
      journal, [&thinning](const LogEvent& event) { Take(event, &thinning); }, &readings);
  return ThinnedJournal(thinning.Thin(how.now_utime));
}

void ThinnedJournal::Rewrite(const LogEvent& event, const Write& write) {
  latest_utime_ = std::max(latest_utime_, event.utime);
  if (IsKeyframe(event)) {
    RewriteKeyframe(event, write);
  } else if (event.channel == channels::kPlaceMatch) {
    RewriteMatch(event, write);
  } else if (event.channel == channels::kConstraint) {
    RewriteConstraint(event, write);
  } else {
    write(event);
  }
}

void ThinnedJournal::RewriteKeyframe(const LogEvent& event, const Write& write) const {
  auto keyframe = ParseMessage<KeyframeMessage>(event.data).value;
  const auto edge = keyframe ? thinned_.edges.find(keyframe->id) : thinned_.edges.end();
  if (edge != thinned_.edges.end()) {
    keyframe->edge = edge->second.edge;
    keyframe->preintegration = edge->second.preintegration;
    WriteMessage(event.utime, event.channel, ToMessage(*keyframe), write);
  } else if (!keyframe || !thinned_.gone.contains(keyframe->id)) {
    write(event);
  }
}

void ThinnedJournal::RewriteMatch(const LogEvent& event, const Write& write) const {
  auto match = ParseMessage<place_match_t>(event.data).value;
  if (!match) {
    return write(event);
  }
  if (thinned_.gone.contains(match->query)) {
    return;
  }
  const auto num_gone = std::erase_if(match->candidates, [this](const PlaceCandidate& candidate) {
    return thinned_.gone.contains(candidate.match);
  });
  if (num_gone == 0) {
    write(event);
  } else {
    WriteMessage(event.utime, event.channel, ToMessage(*match), write);
  }
}

// Derived constraints are all written anew at the end.
void ThinnedJournal::RewriteConstraint(const LogEvent& event, const Write& write) const {
  const auto constraint = ParseMessage<constraint_t>(event.data).value;
  if (!constraint ||
      (constraint->kind != PlaceKind::kDerived && !thinned_.gone.contains(constraint->from) &&
       !thinned_.gone.contains(constraint->to))) {
    write(event);
  }
}

void ThinnedJournal::Finish(const Write& write) const {
  for (const Constraint& constraint : thinned_.derived) {
    WriteMessage(latest_utime_, std::string(channels::kConstraint), ToMessage(constraint), write);
  }
}

}  // namespace pangea::site
