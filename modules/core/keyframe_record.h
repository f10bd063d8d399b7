#pragma once

// A keyframe as bytes and back, the same to the last bit: 45 bytes a corner. For records that the
// same run reads again (byte_record.h).

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/byte_record.h"
#include "core/keyframe.h"

namespace pangea {

std::vector<uint8_t> ToRecord(const Keyframe& keyframe);
// Nothing when these are not the bytes of one.
std::optional<Keyframe> KeyframeFromRecord(std::span<const uint8_t> record);

// Of a part of it.
void PutCorners(const std::vector<Corner>& corners, ByteWriter* writer);
void GetCorners(ByteReader* reader, std::vector<Corner>* corners);

}  // namespace pangea
