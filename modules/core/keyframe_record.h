#pragma once

// Writes a keyframe to bytes (45 for each corner) and reads it again, identical to the last bit.
// Only for records that the same run reads (byte_record.h).

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/byte_record.h"
#include "core/keyframe.h"

namespace pangea {

std::vector<uint8_t> ToRecord(const Keyframe& keyframe);
// Nothing when `record` does not hold exactly one keyframe.
std::optional<Keyframe> KeyframeFromRecord(std::span<const uint8_t> record);

// The same for the corners alone.
void PutCorners(const std::vector<Corner>& corners, ByteWriter* writer);
void GetCorners(ByteReader* reader, std::vector<Corner>* corners);

}  // namespace pangea
