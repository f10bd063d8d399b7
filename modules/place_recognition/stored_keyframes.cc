#include "place_recognition/stored_keyframes.h"

#include <algorithm>
#include <utility>

#include "core/keyframe_record.h"

namespace pangea {
namespace {

constexpr size_t kRayBytes = 4 * sizeof(double);
constexpr size_t kCornerBytes = 45;

constexpr size_t RecordBytes(size_t num_corners) {
  return 2 * sizeof(uint32_t) + (kCornerBytes + kRayBytes) * num_corners;
}

std::vector<uint8_t> ToRecord(const RecognisedKeyframe& keyframe) {
  ByteRecordWriter writer;
  writer.Reserve(RecordBytes(keyframe.corners.size()));
  PutCorners(keyframe.corners, &writer);
  writer.Put(static_cast<uint32_t>(keyframe.rays.size()));
  for (const CornerRay& ray : keyframe.rays) {
    writer.Put(ray.direction);
    writer.Put(ray.sigma);
  }
  return writer.Take();
}

}  // namespace

RecognisedKeyframe::RecognisedKeyframe(const Keyframe& keyframe)
    : id(keyframe.id), descriptor_kind(keyframe.descriptor_kind), corners(keyframe.corners) {
  const Eigen::Quaterniond q_odom_cam = keyframe.T_odom_cam().q;
  rays.reserve(corners.size());
  for (const Corner& corner : corners) {
    CornerRay ray{Eigen::Vector3d::Zero(), 0};
    if (const auto xy = keyframe.camera.Unproject(corner.pixel.cast<double>())) {
      ray.direction = q_odom_cam * Eigen::Vector3d(xy->x(), xy->y(), 1.0).normalized();
      ray.sigma = CornerSigma(corner, keyframe.camera.PixelAngle());
    }
    rays.push_back(ray);
    if (corner.landmark_id != kNoLandmark) {
      landmarks.push_back(corner.landmark_id);
    }
  }
  std::sort(landmarks.begin(), landmarks.end());
}

AscendingNumbers::AscendingNumbers(const std::vector<int32_t>& numbers) {
  if (numbers.empty()) {
    return;
  }
  first_ = numbers.front();
  last_ = numbers.back();
  std::vector<uint8_t> gaps;
  for (size_t i = 1; i < numbers.size(); ++i) {
    auto gap = static_cast<uint32_t>(numbers[i] - numbers[i - 1]);
    for (; gap >= 0x80; gap >>= 7) {
      gaps.push_back(static_cast<uint8_t>(gap | 0x80));
    }
    gaps.push_back(static_cast<uint8_t>(gap));
  }
  gaps_.assign(gaps.begin(), gaps.end());  // without spare capacity
}

bool AscendingNumbers::HasOneOf(const std::vector<int32_t>& ascending) const {
  if (ascending.empty() || last_ < first_ || last_ < ascending.front() ||
      ascending.back() < first_) {
    return false;
  }
  auto other = ascending.begin();
  const auto reaches = [&](int32_t number) {
    while (other != ascending.end() && *other < number) {
      ++other;
    }
    return other != ascending.end() && *other == number;
  };
  int32_t number = first_;
  uint32_t gap = 0;
  int shift = 0;
  for (const uint8_t byte : gaps_) {
    gap |= static_cast<uint32_t>(byte & 0x7f) << shift;
    shift += 7;
    if ((byte & 0x80) == 0) {
      if (reaches(number)) {
        return true;
      }
      number += static_cast<int32_t>(gap);
      gap = 0;
      shift = 0;
    }
  }
  return reaches(number);
}

void AscendingNumbers::Save(ByteWriter* writer) const {
  writer->Put(first_);
  writer->Put(last_);
  writer->Put(gaps_);
}

bool AscendingNumbers::Restore(ByteReader* reader) {
  reader->Get(&first_);
  reader->Get(&last_);
  reader->Get(&gaps_);
  return reader->ok() && IsConsistent();
}

bool AscendingNumbers::IsConsistent() const {
  if (last_ < first_) {
    return gaps_.empty();
  }
  constexpr int kMaxShift = 28;  // five bytes hold every gap
  int64_t number = first_;
  int shift = 0;
  for (const uint8_t byte : gaps_) {
    number += static_cast<int64_t>(byte & 0x7f) << shift;
    shift = (byte & 0x80) == 0 ? 0 : shift + 7;
    if (number > last_ || shift > kMaxShift) {
      return false;
    }
  }
  return first_ >= 0 && shift == 0 && number == last_;
}

std::vector<uint8_t> CornersRecord(const Keyframe& keyframe) {
  return ToRecord(RecognisedKeyframe(keyframe));
}

bool StoredKeyframes::Add(const RecognisedKeyframe& keyframe) {
  Record corners(ToRecord(keyframe), records_.get());
  if (corners.in_memory()) {
    if (counters_.in_memory == kMaxInMemory) {
      ++counters_.dropped;
      return false;
    }
    ++counters_.in_memory;
  }
  keyframes_.push_back({keyframe.id, keyframe.descriptor_kind, AscendingNumbers(keyframe.landmarks),
                        std::move(corners)});
  return true;
}

void StoredKeyframes::Save(ByteWriter* writer) const {
  writer->PutCount(keyframes_.size());
  for (const Stored& keyframe : keyframes_) {
    writer->Put(keyframe.id);
    writer->Put(keyframe.descriptor_kind);
    keyframe.landmarks.Save(writer);
    writer->Put(keyframe.corners.offset());
    writer->Put(keyframe.corners.size());
  }
}

bool StoredKeyframes::Restore(ByteReader* reader) {
  constexpr size_t kMinBytes = 33;
  constexpr size_t kMaxRecordBytes = RecordBytes(kMaxCorners);
  std::deque<Stored> keyframes;
  for (size_t left = reader->GetCount(kMinBytes); left > 0; --left) {
    KeyframeId id;
    auto kind = DescriptorKind::kOrb;
    AscendingNumbers landmarks;
    int64_t offset = 0;
    uint32_t size = 0;
    reader->Get(&id);
    reader->Get(&kind);
    const bool has_landmarks = landmarks.Restore(reader);
    reader->Get(&offset);
    reader->Get(&size);
    if (!has_landmarks || id.seq < 0 || offset < 0 || size > kMaxRecordBytes) {
      return false;
    }
    keyframes.push_back({id, kind, std::move(landmarks), Record(offset, size)});
  }
  keyframes_ = std::move(keyframes);
  return reader->ok();
}

bool StoredKeyframes::SharesLandmark(int number, const RecognisedKeyframe& other) const {
  return keyframes_[number].landmarks.HasOneOf(other.landmarks);
}

std::shared_ptr<const RecognisedKeyframe> StoredKeyframes::Find(int number) {
  if (auto found = found_.Find(number)) {
    return found;
  }
  const Stored& stored = keyframes_[number];
  const auto record = stored.corners.Bytes(records_.get());
  if (!record) {
    ++counters_.unreadable;
    return nullptr;
  }
  ByteRecordReader reader(*record);
  RecognisedKeyframe keyframe;
  keyframe.id = stored.id;
  keyframe.descriptor_kind = stored.descriptor_kind;
  GetCorners(&reader, &keyframe.corners);
  keyframe.rays.resize(reader.GetCount(kRayBytes));
  for (CornerRay& ray : keyframe.rays) {
    reader.Get(&ray.direction);
    reader.Get(&ray.sigma);
  }
  if (!reader.ok() || keyframe.rays.size() != keyframe.corners.size()) {
    ++counters_.unreadable;
    return nullptr;
  }
  auto found = std::make_shared<const RecognisedKeyframe>(std::move(keyframe));
  found_.Add(number, found);
  return found;
}

}  // namespace pangea
