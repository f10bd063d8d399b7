#include "place_recognition/stored_keyframes.h"

#include <algorithm>
#include <utility>

#include "core/keyframe_record.h"

namespace pangea {
namespace {

constexpr size_t kRayBytes = 4 * sizeof(double);
constexpr size_t kCornerBytes = 45;

bool ShareAnElement(const std::vector<int32_t>& a, const std::vector<int32_t>& b) {
  if (a.empty() || b.empty() || a.back() < b.front() || b.back() < a.front()) {
    return false;
  }
  auto i = a.begin();
  auto j = b.begin();
  while (i != a.end() && j != b.end()) {
    if (*i == *j) {
      return true;
    }
    *i < *j ? ++i : ++j;
  }
  return false;
}

std::vector<uint8_t> ToRecord(const RecognisedKeyframe& keyframe) {
  ByteRecordWriter writer;
  writer.Reserve(2 * sizeof(uint32_t) + (kCornerBytes + kRayBytes) * keyframe.corners.size());
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
    : id(keyframe.id), corners(keyframe.corners) {
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
  std::vector<int32_t> landmarks(keyframe.landmarks.begin(), keyframe.landmarks.end());
  keyframes_.push_back({keyframe.id, std::move(landmarks), std::move(corners)});
  return true;
}

void StoredKeyframes::Save(ByteWriter* writer) const {
  writer->PutCount(keyframes_.size());
  for (const Stored& keyframe : keyframes_) {
    writer->Put(keyframe.id);
    writer->Put(keyframe.landmarks);
    writer->Put(keyframe.corners.offset());
    writer->Put(keyframe.corners.size());
  }
}

bool StoredKeyframes::Restore(ByteReader* reader) {
  constexpr size_t kLeastBytes = 32;
  std::vector<Stored> keyframes;
  const size_t count = reader->GetCount(kLeastBytes);
  keyframes.reserve(count);
  for (size_t i = 0; i < count; ++i) {
    KeyframeId id;
    std::vector<int32_t> landmarks;
    int64_t offset = 0;
    uint32_t size = 0;
    reader->Get(&id);
    reader->Get(&landmarks);
    reader->Get(&offset);
    reader->Get(&size);
    keyframes.push_back({id, std::move(landmarks), Record(offset, size)});
  }
  keyframes_ = std::move(keyframes);
  return reader->ok();
}

bool StoredKeyframes::SharesLandmark(int number, const RecognisedKeyframe& other) const {
  return ShareAnElement(keyframes_[number].landmarks, other.landmarks);
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
