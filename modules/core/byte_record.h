#pragma once

// Writes values to bytes exactly as they lie in memory, one after the other, and reads them again.
// Only for records that the same run reads, and for checkpoints, which only the same binary on the
// same machine reads. Never for messages or for files that people keep.

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <cstring>
#include <optional>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

#include "core/ids.h"
#include "core/rigid3.h"

namespace pangea {

class ByteWriter {
 public:
  virtual ~ByteWriter() = default;

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
  // Ids are written field by field, because the padding between the fields is undefined.
  void Put(const MapId& id) {
    Put(id.agent_id);
    Put(id.opened_utime);
  }
  void Put(const KeyframeId& id) {
    Put(id.map);
    Put(id.seq);
  }
  void PutCount(size_t count) { Put(static_cast<uint32_t>(count)); }
  template <typename T>
  void Put(const std::vector<T>& values) {
    PutCount(values.size());
    if constexpr (std::is_arithmetic_v<T>) {
      PutBytes(values.data(), sizeof(T) * values.size());
    } else {
      for (const T& value : values) {
        Put(value);
      }
    }
  }

 protected:
  virtual void PutBytes(const void* data, size_t size) = 0;
};

// A read past the end reads nothing. From then on ok() is false.
class ByteReader {
 public:
  virtual ~ByteReader() = default;

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
  void Get(MapId* id) {
    Get(&id->agent_id);
    Get(&id->opened_utime);
  }
  void Get(KeyframeId* id) {
    Get(&id->map);
    Get(&id->seq);
  }
  // Reads a count of elements. An element takes at least `min_bytes`; if the bytes left cannot hold
  // so many elements, the result is 0 and ok() becomes false.
  size_t GetCount(size_t min_bytes) {
    uint32_t count = 0;
    Get(&count);
    ok_ = ok_ && count <= bytes_left() / min_bytes;
    return ok_ ? count : 0;
  }
  template <typename T>
  void Get(std::vector<T>* values) {
    values->resize(GetCount(std::is_arithmetic_v<T> ? sizeof(T) : 1));
    if constexpr (std::is_arithmetic_v<T>) {
      GetBytes(values->data(), sizeof(T) * values->size());
    } else {
      for (T& value : *values) {
        Get(&value);
      }
    }
  }

  bool ok() const { return ok_; }
  bool at_end() const { return bytes_left() == 0; }

 protected:
  virtual size_t bytes_left() const = 0;
  // `size` is at most bytes_left(). Returns false when the bytes cannot be read.
  virtual bool Read(void* data, size_t size) = 0;

 private:
  void GetBytes(void* data, size_t size) { ok_ = ok_ && size <= bytes_left() && Read(data, size); }

  bool ok_ = true;
};

// Writer and reader of bytes in memory.
class ByteRecordWriter final : public ByteWriter {
 public:
  void Reserve(size_t num_bytes) { bytes_.reserve(num_bytes); }
  std::vector<uint8_t> Take() { return std::move(bytes_); }

 protected:
  void PutBytes(const void* data, size_t size) override {
    const auto* const first = static_cast<const uint8_t*>(data);
    bytes_.insert(bytes_.end(), first, first + size);
  }

 private:
  std::vector<uint8_t> bytes_;
};

class ByteRecordReader final : public ByteReader {
 public:
  explicit ByteRecordReader(std::span<const uint8_t> bytes) : bytes_(bytes) {}

 protected:
  size_t bytes_left() const override { return bytes_.size(); }
  bool Read(void* data, size_t size) override {
    if (size > 0) {
      std::memcpy(data, bytes_.data(), size);
      bytes_ = bytes_.subspan(size);
    }
    return true;
  }

 private:
  std::span<const uint8_t> bytes_;
};

}  // namespace pangea
