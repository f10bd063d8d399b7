#include "messages/keyframe_message.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "core/big_endian.h"
#include "pangea/keyframe_2_t.hpp"
#include "pangea/keyframe_3_t.hpp"
#include "pangea/keyframe_4_t.hpp"

namespace pangea {
namespace {

keyframe_2_t WithErrors(const KeyframeMessage& message) {
  keyframe_2_t whole{};
  whole.keyframe = message;
  whole.scale_sigma = message.scale_sigma;
  std::copy(std::begin(message.T_body_cam_covariance), std::end(message.T_body_cam_covariance),
            whole.T_body_cam_covariance);
  return whole;
}

keyframe_3_t WithKind(const KeyframeMessage& message) {
  keyframe_3_t whole{};
  whole.keyframe = WithErrors(message);
  whole.descriptor_kind = message.descriptor_kind;
  return whole;
}

keyframe_4_t WithTags(const KeyframeMessage& message) {
  keyframe_4_t whole{};
  whole.keyframe = WithKind(message);
  whole.num_tags = static_cast<int8_t>(message.tags.size());
  whole.tags = message.tags;
  return whole;
}

bool HasErrors(const KeyframeMessage& message) {
  return message.scale_sigma != 0 || std::any_of(std::begin(message.T_body_cam_covariance),
                                                 std::end(message.T_body_cam_covariance),
                                                 [](double value) { return value != 0; });
}

void Take(keyframe_2_t whole, KeyframeMessage* message) {
  static_cast<keyframe_t&>(*message) = std::move(whole.keyframe);
  message->scale_sigma = whole.scale_sigma;
  std::copy(std::begin(whole.T_body_cam_covariance), std::end(whole.T_body_cam_covariance),
            message->T_body_cam_covariance);
}

void Take(keyframe_3_t whole, KeyframeMessage* message) {
  message->descriptor_kind = whole.descriptor_kind;
  Take(std::move(whole.keyframe), message);
}

}  // namespace

bool KeyframeMessage::BeginsOne(const uint8_t* begin) {
  const uint64_t fingerprint = GetBigEndian(begin, sizeof(int64_t));
  return fingerprint == static_cast<uint64_t>(keyframe_t::getHash()) ||
         fingerprint == static_cast<uint64_t>(keyframe_2_t::getHash()) ||
         fingerprint == static_cast<uint64_t>(keyframe_3_t::getHash()) ||
         fingerprint == static_cast<uint64_t>(keyframe_4_t::getHash());
}

template <typename Use>
int KeyframeMessage::WithType(Use use) const {
  if (!tags.empty()) {
    return use(WithTags(*this));
  }
  if (descriptor_kind != 0) {
    return use(WithKind(*this));
  }
  return HasErrors(*this) ? use(WithErrors(*this)) : use(static_cast<const keyframe_t&>(*this));
}

int KeyframeMessage::encode(void* buf, int offset, int maxlen) const {
  return WithType([&](const auto& type) { return type.encode(buf, offset, maxlen); });
}

int KeyframeMessage::getEncodedSize() const {
  return WithType([](const auto& type) { return type.getEncodedSize(); });
}

int KeyframeMessage::decode(const void* buf, int offset, int maxlen) {
  *this = {};
  keyframe_4_t newest{};
  if (const int size = newest.decode(buf, offset, maxlen); size >= 0) {
    tags = std::move(newest.tags);
    Take(std::move(newest.keyframe), this);
    return size;
  }
  keyframe_3_t with_kind{};
  if (const int size = with_kind.decode(buf, offset, maxlen); size >= 0) {
    Take(std::move(with_kind), this);
    return size;
  }
  keyframe_2_t whole{};
  if (const int size = whole.decode(buf, offset, maxlen); size >= 0) {
    Take(std::move(whole), this);
    return size;
  }
  return keyframe_t::decode(buf, offset, maxlen);
}

}  // namespace pangea
