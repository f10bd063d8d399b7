#pragma once

// Explains why a constraint was accepted or refused: repeats the verification with the log's
// keyframes and candidate, and shows each step, as text and as a picture of both keyframes.

#include <string>
#include <vector>

#include "core/server_messages.h"
#include "log_file/log_reading.h"
#include "loop_verification/aligner.h"
#include "report/session_record.h"

namespace pangea {

struct Explanation {
  PlaceCandidate candidate;
  Constraint said;   // from the log
  Constraint again;  // computed again from the same keyframes
  LoopVerificationReport report;
  Keyframe from, to;
  std::vector<std::string> options_notes;  // for people: the source of the options
};

// One line for each verification result of the log. Damaged parts of the log are reported in
// `readings` (log_reader.h), here and below.
std::string ListResults(const std::string& log, LogReadings* readings = nullptr);
// Repeats the verification with the options of the log (OPTIONS_*), or the defaults if it has none.
// Throws std::runtime_error if the log lacks the verification result, its candidate or a keyframe.
Explanation Explain(const std::string& log, int64_t constraint_id, LogReadings* readings = nullptr);

// Throws std::runtime_error if no match of two keyframes of these logs has this id, so that no
// replay of them will have it.
void CheckConstraintId(const std::vector<std::string>& logs, int64_t constraint_id,
                       LogReadings* readings = nullptr);

std::string ToText(const Explanation& explanation);
// Each row shows the match on the left and the query on the right: the candidate's corners, PnP,
// and, if it was reached, the window BA; below is the verification result. `recordings`: of the
// agents; without one, corners are drawn on a dark background.
void WriteExplanationPng(const Explanation& explanation, const SessionRecord& recordings,
                         const std::string& path);

}  // namespace pangea
