// Saving the state of a JournalFollower to a checkpoint, and restoring it.

#include <fmt/format.h>

#include <stdexcept>
#include <utility>

#include "bus/status_log.h"
#include "journal_follower/journal_follower.h"

namespace pangea {

// Whether the keyframe may be part of a checkpoint. A keyframe behind a gap may not, because it
// waits for keyframes that may still come.
bool JournalFollower::MayBeKept(const Keyframe& keyframe) const {
  const int32_t next = keyframes_.next(keyframe.id.map);
  if (keyframe.id.seq < next) {
    return true;  // a repeat
  }
  const bool in_order =
      keyframe.id.seq == next || (keyframe.edge && keyframe.edge->from_seq < next);
  return (in_order || !follows_.in_order) &&
         (!checkpoint_.keyframe_is_complete || checkpoint_.keyframe_is_complete(keyframe.id));
}

void JournalFollower::RestoreCheckpoint() {
  const std::filesystem::path& file = checkpoint_.place.file;
  bool knows_keyframes = false;
  keyframes_.VisitStreams([&](const MapId&, int32_t next, const std::vector<int32_t>& waiting) {
    knows_keyframes |= next > 0 || !waiting.empty();
  });
  if (file.empty() || knows_keyframes || !std::filesystem::exists(file)) {
    return;  // there is none, or it would replace keyframes that the process already has
  }
  try {
    CheckpointReader reader(file, {node_.name(), checkpoint_.format, checkpoint_.place.options});
    reader_->StartBehind(reader.head().journal);
    if (!RestoreFollower(&reader)) {
      throw std::runtime_error("it cannot be read");
    }
    checkpoint_journal_ = reader.head().journal;
  } catch (const std::runtime_error& error) {
    reader_->StartBehind({});  // the beginning
    Log(node_.name(), fmt::format("all of the journal is read, the checkpoint {} is not used: {}",
                                  file.string(), error.what()));
  }
}

void JournalFollower::SaveFollower(ByteWriter* writer) const {
  const auto save = [writer](const auto& stream) {
    size_t count = 0;
    stream.VisitStreams([&](const auto&...) { ++count; });
    writer->PutCount(count);
    stream.VisitStreams(
        [writer](const MapId& map, int32_t next, const std::vector<int32_t>& waiting) {
          writer->Put(map);
          writer->Put(next);
          writer->Put(waiting);
        });
  };
  save(keyframes_);
  save(matches_.stream());
}

bool JournalFollower::RestoreFollower(ByteReader* reader) {
  const auto restore = [reader](auto* stream) {
    constexpr size_t kMinBytes = 20;
    for (size_t left = reader->GetCount(kMinBytes); left > 0; --left) {
      MapId map;
      int32_t next = 0;
      std::vector<int32_t> waiting;
      reader->Get(&map);
      reader->Get(&next);
      reader->Get(&waiting);
      stream->Restore(map, next, waiting);
    }
  };
  ReorderBuffer<Item> keyframes;
  MissingMessages matches;
  restore(&keyframes);
  restore(&matches);
  if (!reader->ok() || !checkpoint_.restore(reader)) {
    return false;
  }
  keyframes_ = std::move(keyframes);
  matches_ = std::move(matches);
  keyframes_.VisitStreams([this](const MapId& map, const auto&...) { NoteMapOfFile(map); });
  return true;
}

void JournalFollower::WriteCheckpoint() {
  const JournalState journal = reader_->position();
  if (journal == checkpoint_journal_) {
    return;
  }
  CheckpointWriter writer(checkpoint_.place.file,
                          {node_.name(), checkpoint_.format, checkpoint_.place.options}, journal);
  SaveFollower(&writer);
  checkpoint_.save(&writer);
  writer.Commit();
}

}  // namespace pangea
