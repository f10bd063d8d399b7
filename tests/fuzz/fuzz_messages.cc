// Every other type with a Parse, and the bodies of link packets; the first byte selects the type.

#include <iterator>

#include "fuzz.h"
#include "link/anchor_wire.h"
#include "link/compression.h"
#include "link/wire.h"
#include "messages/catch_up_messages.h"
#include "messages/encoding.h"
#include "messages/messages.h"
#include "messages/state_chunks.h"

namespace pangea::fuzz {
namespace {

template <typename Message>
void ParseBytes(std::vector<uint8_t> bytes) {
  SetFingerprint(Message::getHash(), &bytes);
  Message message{};
  if (!DecodeMessage(bytes, &message)) {
    return;
  }
  const auto parsed = Parse(message);
  Require(parsed.value.has_value() == parsed.refused.empty(), "a refusal has a reason");
  if (parsed.value) {
    Require(Parse(ToMessage(*parsed.value)).value.has_value(), "accepted once, accepted again");
  }
}

// Parses the state in chunks.
void ParseMapState(std::vector<uint8_t> bytes) {
  SetFingerprint(map_state_t::getHash(), &bytes);
  map_state_t message{};
  if (!DecodeMessage(bytes, &message)) {
    return;
  }
  if (auto parsed = Parse(message); parsed.value) {
    StateChunks chunks;
    if (const auto whole =
            chunks.Add(message.chunk, message.num_chunks, std::move(*parsed.value))) {
      for (const map_state_t& chunk : ToMessages(*whole)) {
        Require(Parse(chunk).value.has_value(), "accepted once, accepted again");
      }
    }
  }
}

template <typename Message>
void ParseOnly(std::vector<uint8_t> bytes) {
  SetFingerprint(Message::getHash(), &bytes);
  Message message{};
  if (DecodeMessage(bytes, &message)) {
    const auto parsed = Parse(message);
    Require(parsed.value.has_value() == parsed.refused.empty(), "a refusal has a reason");
  }
}

void ParseHelloBody(std::vector<uint8_t> body) {
  if (const auto hello = ParseHello(1, body); hello.value) {
    Require(ParseHello(1, Encode(*hello.value)).value.has_value(), "accepted once, accepted again");
  }
}

void ParseAckBody(std::vector<uint8_t> body) {
  if (const auto ack = ParseAck(1, {LinkKind::kAck, 1, std::move(body)}); ack.value) {
    Require(ParseAck(1, {LinkKind::kAck, 1, Encode(*ack.value)}).value.has_value(),
            "accepted once, accepted again");
  }
}

void ParsePoseBody(std::vector<uint8_t> body) {
  if (const auto pose = ParsePose(1, body); pose.value) {
    Require(ParsePose(1, EncodePose(*pose.value)).value.has_value(),
            "accepted once, accepted again");
  }
}

void ParseAnchorBodies(std::vector<uint8_t> body) {
  if (const auto numbers = ParseAnchorsReceived(body); numbers.value) {
    Require(ParseAnchorsReceived(EncodeAnchorsReceived(*numbers.value)).value == numbers.value,
            "accepted once, accepted again");
  }
  if (const auto answers = ParseAnchorEditAnswers(body); answers.value) {
    Require(ParseAnchorEditAnswers(EncodeAnchorEditAnswers(*answers.value)).value.has_value(),
            "accepted once, accepted again");
  }
  ParseAnchor(1, body);
  ParseAnchorEdit(1, body);
}

void DecompressAndParse(std::vector<uint8_t> bytes) {
  if (const auto data = Decompress(bytes, kMaxKeyframeBytes)) {
    Require(data->size() <= size_t{kMaxKeyframeBytes}, "no more than allowed");
    Require(Decompress(Compress(*data), kMaxKeyframeBytes) == data, "there and back");
  }
}

}  // namespace
}  // namespace pangea::fuzz

static int FuzzMessages(const uint8_t* data, size_t size) {
  using namespace pangea;
  using namespace pangea::fuzz;
  void (*const targets[])(std::vector<uint8_t>) = {
      ParseBytes<camera_t>,
      ParseBytes<place_match_t>,
      ParseBytes<constraint_t>,
      ParseBytes<correction_t>,
      ParseMapState,
      ParseOnly<have_t>,
      ParseOnly<resend_request_t>,
      ParseHelloBody,
      ParseAckBody,
      ParsePoseBody,
      DecompressAndParse,
      ParseBytes<landmarks_t>,
      ParseOnly<verdict_request_t>,
      ParseBytes<anchor_edit_t>,
      ParseBytes<anchor_t>,
      ParseBytes<shown_anchors_t>,
      ParseAnchorBodies,
      ParseBytes<others_t>,
  };
  if (size > 0) {
    targets[data[0] % std::size(targets)]({data + 1, data + size});
  }
  return 0;
}
static const pangea::fuzz::Target kMessages("messages", FuzzMessages);
