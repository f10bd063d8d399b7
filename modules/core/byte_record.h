#pragma once

// Values one after the other as bytes, exactly as they lie in memory: for records that the same run
// reads again, never for a file that stays or a message.

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <cstring>
#include <optional>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

#include "core/rigid3.h"

namespace pangea {

class ByteRecordWriter {
 public:
  template <typename T>
  requires std::is_trivially_copyable_v<T>
  void Put(const T& value) { PutBytes(&value, sizeof(T)); }
  template <typename Scalar, int kRows, int kColumns>
  void Put(const Eigen::Matrix<Scalar, kRows, kColumns>& matrix) {
    PutBytes(matrix.data(), sizeof(Scalar) * matrix.size());
  }
  void Put(const Eigen::Quaterniond& q) { Put(q.coeffs()); }
  void Put(const Rigid3& T) {
    Put(T.q);
    Put(T.t);
  }

  void Reserve(size_t num_bytes) { bytes_.reserve(num_bytes); }
  std::vector<uint8_t> Take() { return std::move(bytes_); }

 private:
  void PutBytes(const void* data, size_t size) {
    const auto* const first = static_cast<const uint8_t*>(data);
    bytes_.insert(bytes_.end(), first, first + size);
  }

  std::vector<uint8_t> bytes_;
};

// Past the end nothing is read, and ok() is false from then on.
class ByteRecordReader {
 public:
  explicit ByteRecordReader(std::span<const uint8_t> bytes) : bytes_(bytes) {}

  template <typename T>
  requires std::is_trivially_copyable_v<T>
  void Get(T* value) { GetBytes(value, sizeof(T)); }
  template <typename Scalar, int kRows, int kColumns>
  void Get(Eigen::Matrix<Scalar, kRows, kColumns>* matrix) {
    GetBytes(matrix->data(), sizeof(Scalar) * matrix->size());
  }
  void Get(Eigen::Quaterniond* q) { Get(&q->coeffs()); }
  void Get(Rigid3* T) {
    Get(&T->q);
    Get(&T->t);
  }
  // A count of things that take at least `min_bytes` each; 0 where so many cannot follow.
  size_t GetCount(size_t min_bytes) {
    uint32_t count = 0;
    Get(&count);
    ok_ = ok_ && count <= bytes_.size() / min_bytes;
    return ok_ ? count : 0;
  }

  bool ok() const { return ok_; }
  bool at_end() const { return bytes_.empty(); }

 private:
  void GetBytes(void* data, size_t size) {
    ok_ = ok_ && size <= bytes_.size();
    if (ok_) {
      std::memcpy(data, bytes_.data(), size);
      bytes_ = bytes_.subspan(size);
    }
  }

  std::span<const uint8_t> bytes_;
  bool ok_ = true;
};

}  // namespace pangea
