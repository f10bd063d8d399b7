#pragma once

// Why a constraint was accepted or refused: the verification result made again from the log's
// keyframes and the candidate that asked for it, step by step, as text and as a picture of both
// keyframes.

#include <map>
#include <string>
#include <vector>

#include "core/server_messages.h"
#include "log_file/log_reading.h"
#include "loop_verification/aligner.h"

namespace pangea::session {

struct Explanation {
  PlaceCandidate candidate;
  Constraint said;   // as the log has it
  Constraint again;  // made again from the same keyframes
  LoopVerificationReport report;
  Keyframe from, to;
  std::vector<std::string> options_notes;  // for people: where these are from
};

// Every verification result of the log, a line each. What of the log is lost is noted in `readings`
// (log_reader.h), here and below.
std::string ListResults(const std::string& log, LogReadings* readings = nullptr);
// Made again with the options of the log (OPTIONS_*), or the defaults where it has none.
// Throws std::runtime_error when the log lacks the verification result, its candidate or a
// keyframe.
Explanation Explain(const std::string& log, int64_t constraint_id, LogReadings* readings = nullptr);

std::string ToText(const Explanation& explanation);
// Rows of the match on the left and the query on the right: the candidate's corners, PnP, and where
// it got so far the window BA; below them the verification result. `recordings`: folders by agent;
// where there is none, corners on a dark ground.
void WriteExplanationPng(const Explanation& explanation,
                         const std::map<int32_t, std::string>& recordings, const std::string& path);

}  // namespace pangea::session
