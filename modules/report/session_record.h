#pragma once

// What a session keeps beside its log (recordings.json), so that a later replay or explanation
// finds ground truth and images: what each agent played, which anchors were to be
// placed, and what was expected.

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "report/expectations.h"
#include "report/report.h"

namespace pangea::session {

struct SessionRecord {
  std::vector<AgentRun> agents;  // id, recording and the part of it that was played
  Expectations expect;
  std::vector<WantedAnchor> anchors;
};

// Both throw std::runtime_error when the file cannot be written, or read.
void WriteSessionRecord(const SessionRecord& session, const std::filesystem::path& folder);
// Of the logs themselves (KeepRecordings), else of the folders that hold them; empty where there is
// none.
SessionRecord ReadSessionRecord(const std::vector<std::filesystem::path>& logs);

// Who played what, for a log made of others: beside it, as <out>.recordings.json. What was expected
// of the whole is not expected of a part.
void KeepRecordings(const std::vector<std::filesystem::path>& logs,
                    const std::filesystem::path& out);

// Those recordings that are still there, folders by agent.
std::map<int32_t, std::string> RecordingsAtHand(const SessionRecord& session);

}  // namespace pangea::session
