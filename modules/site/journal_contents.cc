#include "site/journal_contents.h"

#include <fmt/format.h>

#include "log_file/checksums.h"
#include "messages/anchor_messages.h"
#include "messages/channels.h"
#include "messages/encoding.h"
#include "messages/messages.h"

namespace pangea::site {
namespace {

std::string KeyframeName(Bytes data) {
  KeyframeMessage message{};
  if (!DecodeMessage(data, &message)) {
    return "";
  }
  const auto id = Parse(message.id).value;
  return id ? "keyframe " + ToString(*id) : "";
}

}  // namespace

std::string NameOf(const LogEvent& event) {
  if (event.channel.starts_with(channels::kKeyframePrefix)) {
    return KeyframeName(event.data);
  }
  if (event.channel == channels::kPlaceMatch) {
    const auto match = ParseMessage<place_match_t>(event.data).value;
    return match ? "match " + ToString(match->query) : "";
  }
  if (event.channel == channels::kConstraint) {
    const auto constraint = ParseMessage<constraint_t>(event.data).value;
    return constraint ? fmt::format("constraint {} {}", ToString(constraint->to), constraint->Id())
                      : "";
  }
  if (event.channel == channels::kAnchorEdit) {
    const auto edit = ParseMessage<anchor_edit_t>(event.data).value;
    return edit ? fmt::format("edit {} {} {}", ToString(edit->anchor), edit->revision,
                              edit->agent_id)
                : "";
  }
  return event.channel.starts_with(channels::kOptionsPrefix) ? event.channel : "";
}

void JournalContents::Take(const LogEvent& event) {
  ++events;
  const uint32_t crc32 = EventChecksum(event.data);
  const std::string name = NameOf(event);
  if (name.empty()) {
    others.push_back(crc32);
  } else if (event.channel.starts_with(channels::kOptionsPrefix)) {
    named[name] = crc32;
  } else {
    named.emplace(name, crc32);
  }
}

JournalContents ReadContents(const std::filesystem::path& journal) {
  JournalContents contents;
  if (!std::filesystem::exists(journal)) {
    return contents;
  }
  LogReadings readings;
  ReadLog(
      journal, [&contents](const LogEvent& event) { contents.Take(event); }, &readings);
  contents.reading = readings.at(journal);
  return contents;
}

bool CountingEvents::Counts(const LogEvent& event) {
  const std::string name = NameOf(event);
  if (name.empty()) {
    return true;
  }
  const auto left = left_.find(name);
  if (left == left_.end() || left->second != EventChecksum(event.data)) {
    return false;
  }
  left_.erase(left);
  return true;
}

}  // namespace pangea::site
