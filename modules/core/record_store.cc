#include "core/record_store.h"

#include <algorithm>

namespace pangea {

Record::Record(std::vector<uint8_t> bytes, RecordStore* store)
    : size_(static_cast<uint32_t>(bytes.size())) {
  if (store != nullptr) {
    offset_ = store->Append(bytes).value_or(kInMemory);
  }
  if (in_memory()) {
    bytes_ = std::make_unique<uint8_t[]>(size_);
    std::copy(bytes.begin(), bytes.end(), bytes_.get());
  }
}

std::optional<std::vector<uint8_t>> Record::Bytes(RecordStore* store) const {
  if (in_memory()) {
    return std::vector<uint8_t>(bytes_.get(), bytes_.get() + size_);
  }
  std::vector<uint8_t> bytes(size_);
  return store->Read(offset_, bytes) ? std::make_optional(std::move(bytes)) : std::nullopt;
}

}  // namespace pangea
