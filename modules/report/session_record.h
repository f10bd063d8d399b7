#pragma once

// The record of a session beside its log (recordings.json), with which a later replay or
// explanation finds ground truth and images: what each agent played, the anchors to be placed, and
// the expectations.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/ids.h"
#include "report/expectations.h"
#include "report/report.h"

namespace pangea {

struct SessionRecord {
  std::vector<AgentRun> agents;  // only id, recording, the part that was played, and its maps
  Expectations expect;
  std::vector<WantedAnchor> anchors;
};

// Both throw std::runtime_error if the file cannot be written or read.
void WriteSessionRecord(const SessionRecord& session, const std::filesystem::path& folder);
// Reads the record of the logs themselves (KeepRecordings), else that of their folders; empty if
// there is none.
SessionRecord ReadSessionRecord(const std::vector<std::filesystem::path>& logs);

// Writes the record for a log made from others, as <out>.recordings.json; without expectations,
// which hold only for the whole session.
void KeepRecordings(const std::vector<std::filesystem::path>& logs,
                    const std::filesystem::path& out);

// Sets the folder of an agent's recording; the part that was played stays as it is known.
void GiveRecording(int32_t agent_id, const std::string& folder, SessionRecord* session);

// The folder of the recording of which the map is, if it is known and still exists.
std::optional<std::string> RecordingOf(const MapId& map, const SessionRecord& session);

}  // namespace pangea
