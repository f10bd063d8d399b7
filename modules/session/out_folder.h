#pragma once

// The folder --out, with all output of a session or a replay.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace pangea::session {

// Throws std::runtime_error if the folder has a file or folder of one of these names that is not of
// an earlier session: keys and the journal of a server, for instance.
void CheckNothingIsReplaced(const std::filesystem::path& out,
                            const std::vector<std::string>& names);

// Throws std::runtime_error if one of these files and folders would be moved aside with an earlier
// session: the journal that is to be continued, for instance.
void CheckNothingNeededIsIn(const std::filesystem::path& out,
                            const std::vector<std::filesystem::path>& needed);

// An earlier session in the folder is moved aside, so nothing is lost. If the folder is still empty
// at the end, the earlier session is moved back.
class OutFolder {
 public:
  // Throws std::runtime_error that names --out if it is a file, or if the folder cannot be created
  // or moved aside.
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
