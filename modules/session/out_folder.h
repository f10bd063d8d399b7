#pragma once

// --out of a session or a replay: the folder that it leaves everything in.

#include <filesystem>
#include <optional>

namespace pangea::session {

// An earlier session in the folder is moved aside: nothing is lost. Where nothing has come into the
// folder by the end, it is moved back.
class OutFolder {
 public:
  // Throws std::runtime_error naming --out: a file, a folder that cannot be made or moved aside.
  explicit OutFolder(const std::filesystem::path& given);
  ~OutFolder();
  OutFolder(const OutFolder&) = delete;
  OutFolder& operator=(const OutFolder&) = delete;

 private:
  void MoveAside(const std::filesystem::path& given);

  const std::filesystem::path folder_;
  std::optional<std::filesystem::path> aside_;  // the earlier session
};

}  // namespace pangea::session
