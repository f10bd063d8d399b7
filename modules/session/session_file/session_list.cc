#include "session/session_file/session_list.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <stdexcept>

#include "files/text_file.h"
#include "options/nearest_word.h"
#include "processes/child_process.h"
#include "session/session_file/session_file.h"

namespace pangea::session {
namespace {

namespace fs = std::filesystem;

// The first line, if it is a comment.
std::string Title(const fs::path& file) {
  std::ifstream stream = OpenFile(file);
  std::string line;
  std::getline(stream, line);
  const size_t text = line.find_first_not_of("# ");
  return line.starts_with('#') && text != std::string::npos ? line.substr(text) : "";
}

std::string DescribeAgent(const AgentScript& agent) {
  std::string text =
      fmt::format("{}: {}", agent.id, agent.keyframes.empty() ? agent.recording : agent.keyframes);
  if (agent.live) {
    text = fmt::format("{}: live{}", agent.id,
                       agent.duration_s > 0 ? fmt::format(", {:g} s", agent.duration_s) : "");
  } else if (agent.start_s > 0 || agent.duration_s > 0) {
    const std::string end =
        agent.duration_s > 0 ? fmt::format("{:g} s", agent.start_s + agent.duration_s) : "its end";
    text += fmt::format(" from {:g} s to {}", agent.start_s, end);
  }
  if (agent.delay_s > 0) {
    text += fmt::format(", after {:g} s", agent.delay_s);
  }
  if (agent.link) {
    text += ", link: " + Describe(*agent.link);
  }
  return text;
}

std::string DescribeFault(const Fault& fault) {
  if (!fault.kill.empty()) {
    return fmt::format("kill {} at {:g} s", fault.kill, fault.at_s);
  }
  return fmt::format("{} from {:g} s to {:g} s",
                     fault.disconnect != 0 ? fmt::format("agent {} disconnected", fault.disconnect)
                                           : fmt::format("{}'s disk full", fault.disk_full),
                     fault.at_s, fault.at_s + fault.seconds);
}

std::string DescribeScript(const SessionScript& script) {
  std::string text;
  for (const AgentScript& agent : script.agents) {
    text += fmt::format("  agent {}\n", DescribeAgent(agent));
  }
  for (const Fault& fault : script.faults) {
    text += fmt::format("  {}\n", DescribeFault(fault));
  }
  for (const AnchorScript& anchor : script.anchors) {
    text += fmt::format("  agent {} places {} at {:g} s of its recording\n", anchor.agent,
                        anchor.name, anchor.at_s);
  }
  if (!script.expect.empty()) {
    std::vector<std::string> bounds;
    for (const auto& [name, bound] : script.expect) {
      bounds.push_back(fmt::format("{} {:g}", name, bound));
    }
    text += fmt::format("  expects {}\n", fmt::join(bounds, ", "));
  }
  return text;
}

std::string DescribeInputs(const fs::path& file, const std::optional<fs::path>& recordings,
                           SessionScript script) {
  const std::vector<std::string> missing = FindInputs(file, recordings, &script);
  return missing.empty() ? "  all of it is at hand\n"
                         : fmt::format("  missing: {}\n", fmt::join(missing, "; "));
}

}  // namespace

fs::path SessionFolder() {
  const fs::path here = "sessions";
  const fs::path installed =
      (ProgramDirectory() / ".." / "share" / "pangea" / here).lexically_normal();
  return !fs::is_directory(here) && fs::is_directory(installed) ? installed : here;
}

std::vector<fs::path> SessionFiles(const fs::path& folder) {
  std::vector<fs::path> files;
  if (fs::is_directory(folder)) {
    for (const auto& entry : fs::directory_iterator(folder)) {
      if (entry.path().extension() == ".yaml") {
        files.push_back(entry.path());
      }
    }
  }
  std::ranges::sort(files);
  return files;
}

fs::path FindSessionFile(const std::string& name_or_file) {
  if (fs::exists(name_or_file)) {
    return name_or_file;
  }
  const fs::path folder = SessionFolder();
  std::vector<std::string> names;
  for (const fs::path& file : SessionFiles(folder)) {
    names.push_back(file.stem().string());
    if (names.back() == name_or_file) {
      return file;
    }
  }
  throw std::runtime_error(
      fmt::format("{}: is no file, and no session in {}/{}", name_or_file, folder.string(),
                  NearestWordHint(fs::path(name_or_file).stem().string(), names)));
}

std::string DescribeSessions(const std::vector<fs::path>& files,
                             const std::optional<fs::path>& recordings) {
  std::string text;
  for (const fs::path& file : files) {
    std::string title;
    std::string details;
    try {
      title = Title(file);
      const SessionScript script = ParseSessionFile(file);
      details = DescribeScript(script) + DescribeInputs(file, recordings, script);
    } catch (const std::runtime_error& error) {
      details = fmt::format("  cannot be run: {}\n", error.what());
    }
    text += fmt::format("{}{}{}\n{}", file.string(), title.empty() ? "" : ": ", title, details);
  }
  return text;
}

}  // namespace pangea::session
