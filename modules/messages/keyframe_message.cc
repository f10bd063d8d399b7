#include "messages/keyframe_message.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "core/big_endian.h"
#include "pangea/keyframe_2_t.hpp"

namespace pangea {
namespace {

keyframe_2_t Whole(const KeyframeMessage& message) {
  keyframe_2_t whole{};
  whole.keyframe = message;
  whole.scale_sigma = message.scale_sigma;
  std::copy(std::begin(message.T_body_cam_covariance), std::end(message.T_body_cam_covariance),
            whole.T_body_cam_covariance);
  return whole;
}

}  // namespace

bool KeyframeMessage::BeginsOne(const uint8_t* begin) {
  const uint64_t fingerprint = GetBigEndian(begin, sizeof(int64_t));
  return fingerprint == static_cast<uint64_t>(keyframe_t::getHash()) ||
         fingerprint == static_cast<uint64_t>(keyframe_2_t::getHash());
}

bool KeyframeMessage::SaysMore() const {
  return scale_sigma != 0 ||
         std::any_of(std::begin(T_body_cam_covariance), std::end(T_body_cam_covariance),
                     [](double value) { return value != 0; });
}

int KeyframeMessage::encode(void* buf, int offset, int maxlen) const {
  return SaysMore() ? Whole(*this).encode(buf, offset, maxlen)
                    : keyframe_t::encode(buf, offset, maxlen);
}

int KeyframeMessage::getEncodedSize() const {
  return SaysMore() ? Whole(*this).getEncodedSize() : keyframe_t::getEncodedSize();
}

int KeyframeMessage::decode(const void* buf, int offset, int maxlen) {
  *this = {};
  keyframe_2_t whole{};
  const int size = whole.decode(buf, offset, maxlen);
  if (size < 0) {
    return keyframe_t::decode(buf, offset, maxlen);
  }
  keyframe_t::operator=(std::move(whole.keyframe));
  scale_sigma = whole.scale_sigma;
  std::copy(std::begin(whole.T_body_cam_covariance), std::end(whole.T_body_cam_covariance),
            T_body_cam_covariance);
  return size;
}

}  // namespace pangea
