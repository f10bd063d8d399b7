#include "link/agent_key.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sodium.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <stdexcept>
#include <system_error>

#include "files/whole_file.h"

namespace pangea {
namespace {

namespace fs = std::filesystem;

constexpr size_t kHexBytes = 2 * SecretKey::kBytes;
constexpr size_t kMaxFileBytes = 4096;

struct RightWord {
  std::string_view word;
  AnchorRight right;
};
constexpr RightWord kRightWords[] = {
    {"read", AnchorRight::kRead}, {"own", AnchorRight::kEditOwn}, {"write", AnchorRight::kEditAll}};

std::string Describe(const fs::path& file, const std::string& what) {
  return fmt::format("key file {}: {}", file.string(), what);
}

[[noreturn]] void Fail(const fs::path& file, const std::string& what) {
  throw std::runtime_error(Describe(file, what));
}

struct OpenFile {
  explicit OpenFile(const fs::path& file)
      : fd(open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK)) {}  // waits not even on a FIFO
  ~OpenFile() {
    if (fd >= 0) {
      close(fd);
    }
  }
  OpenFile(const OpenFile&) = delete;
  OpenFile& operator=(const OpenFile&) = delete;
  const int fd;
};

// Checks the open file and not its path, so that the file which is checked is the one that is read.
void Check(const fs::path& file, int fd) {
  struct stat info {};
  if (fd < 0 || fstat(fd, &info) != 0) {
    const char* const advice = errno == EACCES
                                   ? ": give it to the user that runs this program (chown)"
                               : errno == ENOENT ? "; make one with pangea-agent-handler keygen"
                                                 : "";
    Fail(file, fmt::format("{}{}", std::strerror(errno), advice));
  }
  if (!S_ISREG(info.st_mode)) {
    Fail(file, "is not a file");
  }
  if ((info.st_mode & (S_IRWXG | S_IRWXO)) != 0) {
    Fail(file, fmt::format("others may read or write it: chmod 600 {}", file.string()));
  }
  if (info.st_size > static_cast<off_t>(kMaxFileBytes)) {
    Fail(file, "is no key file: it is too long");
  }
}

// A text that is wiped from memory when it is destroyed.
struct SecretText {
  ~SecretText() { sodium_memzero(bytes.data(), bytes.size()); }
  std::string_view view() const { return {bytes.data(), size}; }
  std::array<char, kMaxFileBytes> bytes{};
  size_t size = 0;
};

SecretText ReadSecret(const fs::path& file) {
  const OpenFile opened(file);
  Check(file, opened.fd);
  SecretText text;
  const ssize_t n = read(opened.fd, text.bytes.data(), text.bytes.size());
  if (n < 0) {
    Fail(file, std::strerror(errno));
  }
  text.size = static_cast<size_t>(n);
  return text;
}

std::optional<SecretKey> FromHex(std::string_view text) {
  std::array<uint8_t, SecretKey::kBytes> bytes{};
  const bool whole =
      text.size() == kHexBytes && sodium_hex2bin(bytes.data(), bytes.size(), text.data(),
                                                 text.size(), nullptr, nullptr, nullptr) == 0;
  auto key = whole ? std::optional<SecretKey>(bytes) : std::nullopt;
  sodium_memzero(bytes.data(), bytes.size());
  return key;
}

// If the line begins with "name:", the text after it, without blanks around it.
std::optional<std::string_view> ValueOf(std::string_view line, std::string_view name) {
  if (!line.starts_with(name) || line.substr(name.size()).substr(0, 1) != ":") {
    return std::nullopt;
  }
  line.remove_prefix(name.size() + 1);
  line.remove_prefix(std::min(line.find_first_not_of(' '), line.size()));
  line = line.substr(0, line.find_last_not_of(" \r") + 1);
  return line;
}

// The right that the line "anchors: WORD" gives.
AnchorRight ReadRight(const fs::path& file, std::string_view word) {
  const auto right = AnchorRightOf(word);
  if (!right) {
    constexpr size_t kMaxSaid = 40;
    Fail(file, fmt::format("it has the line \"anchors: {}\": make it read (see anchors), own (edit "
                           "those it made) or write (edit all), or take the line out (own)",
                           word.substr(0, kMaxSaid)));
  }
  return *right;
}

}  // namespace

std::optional<AnchorRight> AnchorRightOf(std::string_view word) {
  const auto* const found =
      std::find_if(std::begin(kRightWords), std::end(kRightWords),
                   [word](const RightWord& right) { return right.word == word; });
  return found == std::end(kRightWords) ? std::nullopt : std::optional(found->right);
}

std::string WordOf(AnchorRight right) {
  return std::string(
      std::find_if(std::begin(kRightWords), std::end(kRightWords), [right](const RightWord& known) {
        return known.right == right;
      })->word);
}

std::string ToHex(const SecretKey& key) {
  std::string hex(kHexBytes + 1, '\0');  // sodium_bin2hex also writes a final 0
  sodium_bin2hex(hex.data(), hex.size(), key.bytes().data(), key.bytes().size());
  hex.resize(kHexBytes);
  return hex;
}

std::string KeyFileName(int32_t agent_id) { return fmt::format("agent_{}.key", agent_id); }

void MakeKeyFile(const fs::path& file, int32_t agent_id, AnchorRight anchors) {
  std::string text = fmt::format(
      "# Lets agent {0} into a Pangea server. Secret: a copy for the agent (pangea-uplink "
      "--key), a copy for the\n"
      "# server's folder of keys (pangea-agent-handler --keys).\n"
      "agent: {0}\n"
      "key: {1}\n"
      "# What the agent may do with anchors, by the server's copy: read, own (edit those it made), "
      "write (edit all).\n{2}anchors: {3}\n",
      agent_id, ToHex(SecretKey::Random()), anchors == AnchorRight::kEditOwn ? "# " : "",
      WordOf(anchors));
  const bool is_new = WriteNewFile(file, text, S_IRUSR | S_IWUSR);
  sodium_memzero(text.data(), text.size());
  if (!is_new) {
    Fail(file, "exists already, and is left as it is: give another --out");
  }
}

AgentKey ReadKeyFile(const fs::path& file) {
  const SecretText text = ReadSecret(file);
  std::optional<int32_t> agent_id;
  std::optional<SecretKey> key;
  AnchorRight anchors = AnchorRight::kEditOwn;
  for (std::string_view rest = text.view(); !rest.empty();) {
    const std::string_view line = rest.substr(0, rest.find('\n'));
    rest.remove_prefix(std::min(line.size() + 1, rest.size()));
    if (const auto id = ValueOf(line, "agent")) {
      int32_t value = 0;
      const auto [end, error] = std::from_chars(id->data(), id->data() + id->size(), value);
      if (error != std::errc() || end != id->data() + id->size() || value < 1 || value > 65535) {
        Fail(file, "agent must be 1 .. 65535");
      }
      agent_id = value;
    } else if (const auto hex = ValueOf(line, "key")) {
      key = FromHex(*hex);
      if (!key) {
        Fail(file, fmt::format("key must be {} hexadecimal digits", kHexBytes));
      }
    } else if (const auto word = ValueOf(line, "anchors")) {
      anchors = ReadRight(file, *word);
    } else if (!line.empty() && line[0] != '#') {
      Fail(file, "is no key file: it has lines agent:, key: and anchors: only");
    }
  }
  if (!agent_id || !key) {
    Fail(file, "is no key file: it needs the lines agent: and key:");
  }
  return {*agent_id, *key, anchors};
}

SecretKey ReadKeyFileOf(const fs::path& file, int32_t agent_id) {
  const AgentKey read = ReadKeyFile(file);
  if (read.agent_id != agent_id) {
    Fail(file, fmt::format("is agent {}'s, and this is agent {}: give its own key, or --agent {}",
                           read.agent_id, agent_id, read.agent_id));
  }
  return read.key;
}

KeyFolder::Stamps KeyFolder::Look() const {
  Stamps stamps;
  for (const auto& entry : fs::directory_iterator(folder_)) {
    std::error_code gone;
    if (entry.path().extension() == ".key") {
      stamps[entry.path()] = fs::last_write_time(entry.path(), gone);
    }
  }
  return stamps;
}

bool KeyFolder::Changed() const {
  try {
    return !unusable_.empty() || Look() != seen_;
  } catch (const fs::filesystem_error&) {
    return true;
  }
}

bool KeyFolder::IsGone(int32_t agent_id) const {
  const auto file = files_.find(agent_id);
  std::error_code error;
  // A file that cannot be looked at just now is not gone.
  return file == files_.end() || fs::status(file->second, error).type() == fs::file_type::not_found;
}

const AgentKey* KeyFolder::LastOf(const fs::path& file) const {
  const auto last = std::find_if(files_.begin(), files_.end(),
                                 [&file](const auto& item) { return item.second == file; });
  return last == files_.end() ? nullptr : &keys_.at(last->first);
}

std::optional<AgentKey> KeyFolder::ReadOrLast(const fs::path& file) {
  try {
    return ReadKeyFile(file);
  } catch (const std::runtime_error& error) {
    unusable_.emplace_back(error.what());
  }
  const AgentKey* const last = LastOf(file);
  return last == nullptr ? std::nullopt : std::optional(*last);
}

// Of two keys of an agent, the one that the last Read returned is preferred, then the one with the
// usual file name.
int KeyFolder::Rank(const fs::path& file, int32_t agent_id) const {
  const auto last = files_.find(agent_id);
  return last != files_.end() && last->second == file         ? 2
         : file.filename() == fs::path(KeyFileName(agent_id)) ? 1
                                                              : 0;
}

std::map<int32_t, AgentKey> KeyFolder::Read() {
  std::error_code error;
  if (!fs::is_directory(folder_, error)) {
    throw std::runtime_error(
        fmt::format("no folder of keys {}: make it, and in it a key for each agent "
                    "(pangea-agent-handler keygen --agent 1 --out {})",
                    folder_.string(), (folder_ / KeyFileName(1)).string()));
  }
  const Stamps stamps = Look();
  std::map<int32_t, AgentKey> keys;
  std::map<int32_t, fs::path> files;
  unusable_.clear();
  for (const auto& [file, stamp] : stamps) {
    const auto read = ReadOrLast(file);
    if (!read) {
      continue;
    }
    const int32_t id = read->agent_id;
    const auto [counts, is_first] = files.emplace(id, file);
    const bool comes_first = is_first || Rank(file, id) > Rank(counts->second, id);
    if (!is_first) {
      unusable_.push_back(
          Describe(comes_first ? counts->second : file,
                   fmt::format("is a second key of agent {}: take one of them out", id)));
    }
    if (comes_first) {
      counts->second = file;
      keys.insert_or_assign(id, *read);
    }
  }
  seen_ = stamps;
  files_ = std::move(files);
  keys_ = keys;
  return keys;
}

}  // namespace pangea
