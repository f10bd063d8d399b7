#pragma once

// Messages by which processes catch up, to domain types and back: which keyframes exist (have_t),
// in which file (journal_file_t), and what is to be sent again (resend_request_t,
// verdict_request_t). As in messages.h, after Parse every field is within bounds.

#include <string>
#include <utility>
#include <vector>

#include "core/ids.h"
#include "messages/messages.h"
#include "pangea/have_t.hpp"
#include "pangea/journal_file_t.hpp"
#include "pangea/resend_request_t.hpp"
#include "pangea/verdict_request_t.hpp"

namespace pangea {

struct Have {
  std::vector<std::pair<MapId, int32_t>> highest_seq;  // for each map
  std::vector<SeqGap> gaps;                            // keyframes that are lost for good
};

// A state of the journal. Two files with an equal state are the same journal up to that point.
struct JournalState {
  int64_t num_bytes = 0;
  int64_t last_event_offset = -1;  // of the last whole event within num_bytes; -1: none
  uint32_t last_event_crc32 = 0;

  bool operator==(const JournalState&) const = default;
};

struct JournalFile {
  std::string path;
  JournalState state;
};

struct ResendRequest {
  std::string requester;  // a process name: the answers go to AGAIN_<requester>
  std::string channel;
  SeqGap range;
};

// Names of verification results on candidates whose queries are keyframes of one map: the query's
// seq and the constraint's id.
struct ResultNames {
  static constexpr size_t kMax = 500;

  MapId map;
  std::vector<std::pair<int32_t, int64_t>> results;  // at most kMax
};

struct VerificationRequest {
  std::string requester;
  ResultNames names;
};

Parsed<Have> Parse(const have_t& message);
Parsed<JournalFile> Parse(const journal_file_t& message);
journal_file_t ToMessage(const JournalFile& file);
Parsed<ResendRequest> Parse(const resend_request_t& message);
Parsed<VerificationRequest> Parse(const verdict_request_t& message);

}  // namespace pangea
