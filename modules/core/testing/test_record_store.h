#pragma once

// A RecordStore for tests. It takes at most `max_records`, and cannot read any while `broken`.

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/record_store.h"

namespace pangea::test {

class TestRecordStore : public RecordStore {
 public:
  explicit TestRecordStore(size_t max_records) : max_records_(max_records) {}

  std::optional<int64_t> Append(std::span<const uint8_t> record) override {
    if (records_.size() == max_records_) {
      problem_ = "no room";
      return std::nullopt;
    }
    records_.emplace_back(record.begin(), record.end());
    return static_cast<int64_t>(records_.size()) - 1;
  }
  bool Read(int64_t offset, std::span<uint8_t> record) override {
    if (broken || records_[offset].size() != record.size()) {
      problem_ = "broken";
      return false;
    }
    ++num_read;
    std::ranges::copy(records_[offset], record.begin());
    return true;
  }
  std::string problem() const override { return problem_; }

  size_t size() const { return records_.size(); }

  bool broken = false;
  int num_read = 0;

 private:
  size_t max_records_;
  std::vector<std::vector<uint8_t>> records_;
  std::string problem_;
};

}  // namespace pangea::test
