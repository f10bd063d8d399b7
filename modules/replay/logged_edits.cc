#include "replay/logged_edits.h"

#include <iterator>
#include <optional>
#include <set>
#include <utility>

#include "log_file/log_reader.h"
#include "messages/channels.h"
#include "messages/encoding.h"
#include "messages/messages.h"

namespace pangea {

LoggedEdits ReadAnchorEdits(const std::filesystem::path& log, LogReadings* readings) {
  LoggedEdits edits;
  std::vector<anchor_edit_t> before_any;
  std::set<int64_t> seqs;
  std::optional<KeyframeId> newest;
  const auto take = [&](const LogEvent& event) {
    if (event.channel.starts_with(channels::kKeyframePrefix)) {
      KeyframeMessage message{};
      const auto id = DecodeMessage(event.data, &message) ? Parse(message.id).value : std::nullopt;
      if (id && !newest) {
        edits[*id] = std::move(before_any);
      }
      newest = id ? id : newest;
    } else if (event.channel == channels::kAnchorEdit) {
      anchor_edit_t edit{};
      if (DecodeMessage(event.data, &edit) && seqs.insert(edit.seq).second) {
        (newest ? edits[*newest] : before_any).push_back(std::move(edit));
      }
    }
  };
  ReadLog(log.string(), take, readings);
  return edits;
}

void Merge(const LoggedEdits& edits, LoggedEdits* all) {
  for (const auto& [keyframe, of_keyframe] : edits) {
    auto& known = (*all)[keyframe];
    known.insert(known.end(), of_keyframe.begin(), of_keyframe.end());
  }
}

}  // namespace pangea
