#include "core/keyframe_store.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/keyframe_record.h"

namespace pangea {

KeyframeView::KeyframeView(std::shared_ptr<const Keyframe> keyframe)
    : keyframe_(std::move(keyframe)),
      T_odom_cam_(keyframe_->T_odom_cam()),
      grid_(keyframe_->corners) {
  const CameraModel& camera = keyframe_->camera;
  const int n = static_cast<int>(keyframe_->corners.size());
  has_ray_.assign(n, false);
  rays_.assign(n, Eigen::Vector2f::Zero());
  pixel_jacobians_.assign(n, Eigen::Matrix2f::Identity());

  for (int i = 0; i < n; ++i) {
    const Corner& corner = keyframe_->corners[i];
    if (corner.landmark_id != kNoLandmark) {
      landmark_corners_.emplace_back(corner.landmark_id, i);
    }
    const auto ray = camera.Unproject(corner.pixel.cast<double>());
    if (!ray) {
      continue;
    }
    Eigen::Matrix<double, 2, 3> J;
    if (!camera.Project(Eigen::Vector3d(ray->x(), ray->y(), 1.0), &J)) {
      continue;
    }
    has_ray_[i] = true;
    rays_[i] = ray->cast<float>();
    pixel_jacobians_[i] = J.leftCols<2>().cast<float>();
  }
  std::sort(landmark_corners_.begin(), landmark_corners_.end());
}

std::vector<int> KeyframeView::CornersOfLandmark(int32_t landmark_id) const {
  std::vector<int> corners;
  for (auto it = std::lower_bound(landmark_corners_.begin(), landmark_corners_.end(),
                                  std::make_pair(landmark_id, 0));
       it != landmark_corners_.end() && it->first == landmark_id; ++it) {
    corners.push_back(it->second);
  }
  return corners;
}

std::vector<uint8_t> KeyframeStore::RecordOf(Keyframe keyframe,
                                             const KeyframeStoreOptions& options) {
  if (!options.keep_preintegration) {
    keyframe.preintegration.reset();
  }
  return ToRecord(keyframe);
}

void KeyframeStore::Save(ByteWriter* writer) const {
  writer->PutCount(keyframes_.size());
  for (const auto& [id, stored] : keyframes_) {
    writer->Put(id);
    writer->Put(stored.record.offset());
    writer->Put(stored.record.size());
    writer->Put(stored.p_odom_body);
    writer->Put(stored.edge_from_seq.has_value());
    writer->Put(stored.edge_from_seq.value_or(0));
    writer->Put(stored.edge_m);
  }
}

bool KeyframeStore::Restore(ByteReader* reader) {
  constexpr size_t kMinBytes = 60;
  std::map<KeyframeId, Stored> keyframes;
  for (size_t left = reader->GetCount(kMinBytes); left > 0; --left) {
    KeyframeId id;
    int64_t offset = 0;
    uint32_t size = 0;
    Eigen::Vector3d p_odom_body = Eigen::Vector3d::Zero();
    bool has_edge = false;
    int32_t edge_from_seq = 0;
    double edge_m = 0;
    reader->Get(&id);
    reader->Get(&offset);
    reader->Get(&size);
    reader->Get(&p_odom_body);
    reader->Get(&has_edge);
    reader->Get(&edge_from_seq);
    reader->Get(&edge_m);
    if (offset < 0) {
      return false;  // it would be a record in memory
    }
    keyframes.emplace_hint(keyframes.end(), id,
                           Stored{Record(offset, size), p_odom_body,
                                  has_edge ? std::optional(edge_from_seq) : std::nullopt, edge_m});
  }
  if (!reader->ok() || !reader->at_end()) {
    return false;
  }
  keyframes_ = std::move(keyframes);
  return true;
}

void KeyframeStore::Add(Keyframe keyframe) {
  const KeyframeId id = keyframe.id;
  if (keyframes_.contains(id)) {
    return;
  }
  Stored stored{Record(RecordOf(keyframe, options_), records_.get()), keyframe.T_odom_body.t, {}};
  if (keyframe.edge) {
    stored.edge_from_seq = keyframe.edge->from_seq;
    stored.edge_m = keyframe.edge->T_from_this.t.norm();
  }
  if (stored.record.in_memory()) {
    in_memory_.push_back(id);
    ++counters_.in_memory;
  }
  keyframes_.emplace(id, std::move(stored));
  if (in_memory_.size() > static_cast<size_t>(options_.max_in_memory)) {
    DropOne();
  }
}

void KeyframeStore::DropOne() {
  const KeyframeId id = in_memory_.front();
  views_.Erase(id);
  keyframes_.erase(id);
  in_memory_.pop_front();
  // Most often the one before it was dropped before.
  const auto before = lost_.extract({id.map, id.seq - 1});
  NoteLost(id.map, before.empty() ? id.seq : before.mapped(), id.seq);
  --counters_.in_memory;
  ++counters_.dropped;
}

std::shared_ptr<const KeyframeView> KeyframeStore::Find(const KeyframeId& id) {
  if (auto view = views_.Find(id)) {
    return view;
  }
  const auto stored = keyframes_.find(id);
  if (stored == keyframes_.end()) {
    return nullptr;
  }
  const auto record = stored->second.record.Bytes(records_.get());
  auto keyframe = record ? KeyframeFromRecord(*record) : std::nullopt;
  if (!keyframe) {
    ++counters_.unreadable;
    return nullptr;
  }
  auto view =
      std::make_shared<const KeyframeView>(std::make_shared<const Keyframe>(*std::move(keyframe)));
  views_.Add(id, view);
  return view;
}

KeyframeWindow KeyframeStore::WindowUpTo(const KeyframeId& id, int count) {
  KeyframeWindow window;
  KeyframeId next = id;
  while (static_cast<int>(window.size()) < count) {
    auto view = Find(next);
    if (view == nullptr) {
      break;
    }
    window.push_back(view);
    if (!view->keyframe().edge) {
      break;
    }
    next.seq = view->keyframe().edge->from_seq;
  }
  std::reverse(window.begin(), window.end());
  return window;
}

KeyframeWindow KeyframeStore::WindowBehind(const KeyframeId& id, int count) {
  KeyframeWindow window;
  for (KeyframeId next = id; static_cast<int>(window.size()) < count;) {
    const int32_t before = next.seq++;
    auto view = Find(next);
    if (view == nullptr || !view->keyframe().edge || view->keyframe().edge->from_seq != before) {
      break;
    }
    window.push_back(std::move(view));
  }
  return window;
}

void KeyframeStore::NoteLost(const MapId& map, int32_t from_seq, int32_t to_seq) {
  lost_[{map, to_seq}] = from_seq;
}

std::optional<int32_t> KeyframeStore::LostSince(const KeyframeId& id) const {
  const auto it = lost_.lower_bound(id);
  if (it != lost_.end() && it->first.map == id.map && it->second <= id.seq) {
    return it->second;
  }
  return std::nullopt;
}

bool KeyframeStore::WindowIsComplete(const KeyframeId& id, int count) const {
  KeyframeId next = id;
  for (int i = 0; i < count; ++i) {
    const auto it = keyframes_.find(next);
    if (it == keyframes_.end()) {
      return LostSince(next).has_value();
    }
    if (!it->second.edge_from_seq) {
      return true;
    }
    next.seq = *it->second.edge_from_seq;
  }
  return true;
}

bool KeyframeStore::ChainIsComplete(const KeyframeId& older, const KeyframeId& newer) const {
  KeyframeId next = newer;
  while (next.seq > older.seq) {
    const auto it = keyframes_.find(next);
    if (it != keyframes_.end()) {
      if (!it->second.edge_from_seq) {
        return true;
      }
      next.seq = *it->second.edge_from_seq;
    } else if (const auto lost_since = LostSince(next)) {
      next.seq = *lost_since - 1;
    } else {
      return false;
    }
  }
  return true;
}

std::optional<double> KeyframeStore::PathBetween(const KeyframeId& older,
                                                 const KeyframeId& newer) const {
  double path_m = 0;
  KeyframeId next = newer;
  const Stored* after_gap = nullptr;
  while (next.seq >= older.seq) {
    const auto it = keyframes_.find(next);
    if (it == keyframes_.end()) {
      const auto lost_since = LostSince(next);
      if (!lost_since) {
        return std::nullopt;
      }
      next.seq = *lost_since - 1;
      continue;
    }
    const Stored& keyframe = it->second;
    if (after_gap != nullptr) {
      path_m += (after_gap->p_odom_body - keyframe.p_odom_body).norm();
      after_gap = nullptr;
    }
    if (next == older) {
      return path_m;
    }
    if (!keyframe.edge_from_seq) {
      return std::nullopt;
    }
    next.seq = *keyframe.edge_from_seq;
    if (keyframes_.contains(next)) {
      path_m += keyframe.edge_m;
    } else {
      after_gap = &keyframe;
    }
  }
  return std::nullopt;
}

}  // namespace pangea
