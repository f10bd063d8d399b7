#include "link/anchor_wire.h"

#include <limits>
#include <utility>

#include "link/bytes_io.h"
#include "messages/encoding.h"
#include "messages/messages_checks.h"

namespace pangea {
namespace {

constexpr uint64_t kMaxInt64 = std::numeric_limits<int64_t>::max();

using messages_checks::Refused;

int64_t ReadInt64(WireReader* reader) { return static_cast<int64_t>(reader->Varint(kMaxInt64)); }

}  // namespace

std::vector<uint8_t> EncodeAnchorEdit(const AnchorEdit& edit) {
  return EncodeMessage(ToMessage(edit));
}

Parsed<AnchorEdit> ParseAnchorEdit(int32_t agent_id, Bytes body) {
  anchor_edit_t message{};
  if (body.size() > size_t{kMaxAnchorBytes} || !DecodeMessage(body, &message)) {
    return Refused<AnchorEdit>("anchor edit does not decode, or is too large");
  }
  auto edit = Parse(message);
  if (edit.value && edit.value->agent_id != agent_id) {
    return Refused<AnchorEdit>("anchor edit of another agent");
  }
  return edit;
}

std::vector<uint8_t> EncodeAnchor(int64_t number, Bytes message) {
  WireWriter writer;
  writer.Varint(static_cast<uint64_t>(number));
  writer.Raw(message);
  return writer.Take();
}

Parsed<LinkAnchor> ParseAnchor(int32_t agent_id, Bytes body) {
  WireReader reader(body);
  const int64_t number = ReadInt64(&reader);
  const Bytes rest = reader.Rest();
  anchor_t message{};
  if (!reader.ok() || number < 1 || rest.size() > size_t{kMaxAnchorBytes} ||
      !DecodeMessage(rest, &message)) {
    return Refused<LinkAnchor>("anchor does not decode, or is too large");
  }
  auto state = Parse(message);
  if (!state.value || state.value->map.agent_id != agent_id) {
    return Refused<LinkAnchor>(state.value ? "anchor in another agent's map" : state.refused);
  }
  return {LinkAnchor{number, *std::move(state.value)}, ""};
}

std::vector<uint8_t> EncodeAnchorsReceived(const std::vector<int64_t>& numbers) {
  WireWriter writer;
  writer.Varint(numbers.size());
  for (const int64_t number : numbers) {
    writer.Varint(static_cast<uint64_t>(number));
  }
  return writer.Take();
}

Parsed<std::vector<int64_t>> ParseAnchorsReceived(Bytes body) {
  WireReader reader(body);
  std::vector<int64_t> numbers;
  const uint64_t count = reader.Varint(kMaxAnchorsReceived);
  for (uint64_t i = 0; i < count && reader.ok(); ++i) {
    numbers.push_back(ReadInt64(&reader));
  }
  return reader.AtEnd() ? Parsed<std::vector<int64_t>>{std::move(numbers), ""}
                        : Refused<std::vector<int64_t>>("anchors received: does not decode");
}

std::vector<uint8_t> EncodeAnchorEditAnswers(const std::vector<AnchorEditAnswer>& answers) {
  WireWriter writer;
  writer.Varint(answers.size());
  for (const AnchorEditAnswer& answer : answers) {
    writer.Varint(static_cast<uint64_t>(answer.anchor.agent_id));
    writer.Fixed(answer.anchor.created_utime);
    writer.Varint(static_cast<uint64_t>(answer.revision));
    writer.Fixed(static_cast<uint8_t>(answer.journalled));
  }
  return writer.Take();
}

Parsed<std::vector<AnchorEditAnswer>> ParseAnchorEditAnswers(Bytes body) {
  WireReader reader(body);
  std::vector<AnchorEditAnswer> answers;
  const uint64_t count = reader.Varint(kMaxAnchorEditAnswers);
  for (uint64_t i = 0; i < count && reader.ok(); ++i) {
    AnchorEditAnswer& answer = answers.emplace_back();
    answer.anchor.agent_id = static_cast<int32_t>(reader.Varint(65535));
    answer.anchor.created_utime = reader.Fixed<int64_t>();
    answer.revision = ReadInt64(&reader);
    answer.journalled = reader.Fixed<uint8_t>() != 0;
  }
  return reader.AtEnd()
             ? Parsed<std::vector<AnchorEditAnswer>>{std::move(answers), ""}
             : Refused<std::vector<AnchorEditAnswer>>("anchor edit answers: do not decode");
}

}  // namespace pangea
