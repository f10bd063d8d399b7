#include "messages/catch_up_messages.h"

#include <algorithm>
#include <cctype>

#include "messages/messages_checks.h"

namespace pangea {

using namespace messages_checks;

namespace {

constexpr size_t kMaxPathBytes = 500;
constexpr size_t kMaxProcessName = 40;  // with AGAIN_ below LCM's 63 characters

bool IsProcessName(const std::string& name) {
  return !name.empty() && name.size() <= kMaxProcessName &&
         std::all_of(name.begin(), name.end(),
                     [](unsigned char c) { return std::isalnum(c) != 0 || c == '_'; });
}

Parsed<SeqGap> ParseGap(const seq_gap_t& m) {
  const auto map = Parse(m.map);
  if (!map.value) {
    return Refused<SeqGap>(map.refused);
  }
  if (m.from_seq < 0 || m.to_seq < m.from_seq || m.to_seq > kMaxSeq) {
    return Refused<SeqGap>("gap out of range");
  }
  return {SeqGap{*map.value, m.from_seq, m.to_seq}, ""};
}

}  // namespace

Parsed<Have> Parse(const have_t& m) {
  Have have;
  for (int i = 0; i < m.num_maps; ++i) {
    const auto map = Parse(m.maps[i]);
    if (!map.value || m.highest_seq[i] < 0 || m.highest_seq[i] > kMaxSeq) {
      return Refused<Have>("have: invalid map or seq");
    }
    have.highest_seq.emplace_back(*map.value, m.highest_seq[i]);
  }
  for (const seq_gap_t& item : m.gaps) {
    const auto gap = ParseGap(item);
    if (!gap.value) {
      return Refused<Have>("have: " + gap.refused);
    }
    have.gaps.push_back(*gap.value);
  }
  return {std::move(have), ""};
}

Parsed<JournalFile> Parse(const journal_file_t& m) {
  if (m.path.size() > kMaxPathBytes || !m.path.starts_with('/')) {
    return Refused<JournalFile>("journal file: path is too long, or not absolute");
  }
  if (m.num_bytes < 0 || m.last_event_offset < -1 ||
      m.last_event_offset >= std::max<int64_t>(m.num_bytes, 1)) {
    return Refused<JournalFile>("journal file: bytes or last event out of range");
  }
  return {
      JournalFile{m.path,
                  {m.num_bytes, m.last_event_offset, static_cast<uint32_t>(m.last_event_crc32)}},
      ""};
}

journal_file_t ToMessage(const JournalFile& file) {
  journal_file_t message{};
  message.path = file.path;
  message.num_bytes = file.state.num_bytes;
  message.last_event_offset = file.state.last_event_offset;
  message.last_event_crc32 = static_cast<int32_t>(file.state.last_event_crc32);
  return message;
}

// to_seq may be any large number: it then means "up to the end".
Parsed<ResendRequest> Parse(const resend_request_t& m) {
  const auto map = Parse(m.map);
  if (!IsProcessName(m.requester) || !map.value || m.from_seq < 0 || m.to_seq < m.from_seq) {
    return Refused<ResendRequest>("resend request: requester, map or range is invalid");
  }
  const int32_t to_seq = std::min(m.to_seq, kMaxSeq);
  return {
      ResendRequest{m.requester, m.channel, {*map.value, std::min(m.from_seq, kMaxSeq), to_seq}},
      ""};
}

Parsed<VerificationRequest> Parse(const verdict_request_t& m) {
  const auto map = Parse(m.map);
  if (!IsProcessName(m.requester) || !map.value || m.num_verdicts > int{ResultNames::kMax}) {
    return Refused<VerificationRequest>("verification request: requester, map or count is invalid");
  }
  VerificationRequest request{m.requester, {*map.value, {}}};
  for (int i = 0; i < m.num_verdicts; ++i) {
    if (m.seq[i] < 0 || m.seq[i] > kMaxSeq) {
      return Refused<VerificationRequest>("verification request: seq out of range");
    }
    request.names.results.emplace_back(m.seq[i], m.constraint_id[i]);
  }
  return {std::move(request), ""};
}

}  // namespace pangea
