// A segment of a spool after a crash or a power cut, or from a stranger.

#include <iostream>
#include <stdexcept>

#include "fuzz.h"
#include "messages/encoding.h"
#include "messages/messages.h"
#include "uplink/spool.h"

namespace pangea::fuzz {
namespace {

constexpr int32_t kAgent = 1;
constexpr int64_t kMaxBytes = 1 << 20;

bool IsKeyframe(const std::vector<uint8_t>& data, const KeyframeId& id) {
  KeyframeMessage message{};
  return DecodeMessage(data, &message) && Parse(message.id).value == id;
}

// All kept keyframes must be the agent's, and a read keyframe must be the requested one.
void Use(Spool* spool) {
  for (const KeyframeId& id : spool->Kept()) {
    Require(id.map.agent_id == kAgent, "only the agent's own keyframes");
    const std::vector<uint8_t> data = spool->Read(id);
    Require(data.empty() || IsKeyframe(data, id), "the keyframe that was asked for");
  }
}

}  // namespace
}  // namespace pangea::fuzz

static int FuzzSpool(const uint8_t* data, size_t size) {
  using namespace pangea;
  std::cerr.rdbuf(nullptr);  // each damaged segment prints a warning
  const auto folder = fuzz::ScratchFolder() / "spool";
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder);
  fuzz::WriteFile(folder / "keyframes_000001.lcm", {data, size});
  try {
    const KeyframeId added{{fuzz::kAgent, 1}, 0};
    {
      Spool spool(folder, fuzz::kAgent, fuzz::kMaxBytes);
      fuzz::Use(&spool);
      spool.Add(added, {data, size}, 1);
    }
    Spool again(folder, fuzz::kAgent, fuzz::kMaxBytes);
    fuzz::Use(&again);
    for (const KeyframeId& id : again.Kept()) {
      again.Release(id.map, id.seq);
    }
    fuzz::Require(again.Kept().empty() && again.bytes() == 0, "what is acknowledged goes");
  } catch (const std::runtime_error& error) {
    fuzz::Require(*error.what() != 0, "a refusal has a reason");
  }
  return 0;
}
static const pangea::fuzz::Target kSpool("spool", FuzzSpool);
