#include "site/journal_writer.h"

#include <fmt/format.h>

#include <cerrno>
#include <cstring>
#include <stdexcept>

namespace pangea::site {

JournalWriter::JournalWriter(const std::filesystem::path& path) : path_(path) {
  if (std::filesystem::exists(path)) {
    throw std::runtime_error(fmt::format("{}: exists; nothing is overwritten", path.string()));
  }
  journal_ = std::make_unique<Journal>(
      path.string(), [](const std::string&, Bytes, const JournalPlace&) { return true; });
}

void JournalWriter::Write(int64_t utime, const std::string& channel, Bytes data) {
  if (journal_->Full()) {
    Finish();
  }
  journal_->Append(utime, channel, data);
  ++count_;
}

void JournalWriter::Finish() {
  if (!journal_->Sync()) {
    throw std::runtime_error(fmt::format("{}: cannot be written: {}; make room on the disk",
                                         path_.string(), std::strerror(errno)));
  }
}

}  // namespace pangea::site
