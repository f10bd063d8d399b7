#pragma once

// Reads and writes parts of files, and waits until they are on the disk.

#include <cstddef>
#include <cstdint>
#include <filesystem>

namespace pangea {

// Read or write all `size` bytes, and continue after interruptions. False with errno set; errno 0
// means that the file ends too early.
bool ReadFully(int fd, int64_t offset, void* out, size_t size);
bool WriteFully(int fd, int64_t offset, const void* data, size_t size);

// Returns when all that was written to the file, or all new names in the folder, survive a power
// cut. The first returns false with errno set when it fails, the second throws std::runtime_error.
bool TrySyncToDisk(const std::filesystem::path& path);
void SyncToDisk(const std::filesystem::path& path);

}  // namespace pangea
