#include "viewer/image_parts.h"

#include <algorithm>

#include "viewer/scene/scene.h"

namespace pangea::viewer {
namespace {

constexpr int32_t kMaxSide = 10'000;  // pixels

bool Plausible(const image_t& chunk) {
  const bool raw = chunk.encoding == image_t::ENCODING_RAW8;
  return (raw || chunk.encoding == image_t::ENCODING_PNG) && chunk.width > 0 && chunk.height > 0 &&
         chunk.width <= kMaxSide && chunk.height <= kMaxSide && chunk.num_chunks > 0 &&
         chunk.chunk >= 0 && chunk.chunk < chunk.num_chunks && chunk.total_bytes > 0 &&
         chunk.total_bytes <= ImageParts::kMaxImageBytes && chunk.num_bytes >= 0 &&
         chunk.offset_bytes >= 0 && chunk.offset_bytes <= chunk.total_bytes - chunk.num_bytes &&
         (!raw || chunk.total_bytes == chunk.width * chunk.height);
}

}  // namespace

std::optional<ShownImage> ImageParts::Add(int32_t agent_id, const image_t& chunk,
                                          std::string* refused) {
  if (!Plausible(chunk) || (pending_.size() >= Scene::kMaxAgents && !pending_.contains(agent_id))) {
    *refused = "image: size, encoding or chunk does not fit";
    return std::nullopt;
  }
  auto& of_agent = pending_[agent_id];
  Pending& pending = of_agent[chunk.utime];
  if (pending.have.empty()) {
    pending.image = {agent_id,       chunk.utime,
                     chunk.encoding, chunk.width,
                     chunk.height,   std::vector<uint8_t>(static_cast<size_t>(chunk.total_bytes))};
    pending.have.resize(static_cast<size_t>(chunk.num_chunks));
    pending.missing = pending.have.size();
  }
  if (pending.have.size() != static_cast<size_t>(chunk.num_chunks) ||
      pending.image.bytes.size() != static_cast<size_t>(chunk.total_bytes)) {
    *refused = "image: its chunks contradict each other";
    return std::nullopt;
  }
  std::copy_n(chunk.data.begin(), chunk.num_bytes,
              pending.image.bytes.begin() + chunk.offset_bytes);
  if (!pending.have[static_cast<size_t>(chunk.chunk)]) {
    pending.have[static_cast<size_t>(chunk.chunk)] = true;
    --pending.missing;
  }
  if (pending.missing > 0) {
    if (of_agent.size() > kMaxPending) {
      of_agent.erase(of_agent.begin());
    }
    return std::nullopt;
  }
  std::optional<ShownImage> whole = std::move(pending.image);
  of_agent.erase(chunk.utime);
  return whole;
}

}  // namespace pangea::viewer
