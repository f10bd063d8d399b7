// Option files, session files and key files; the first byte selects the kind.

#include <iterator>
#include <stdexcept>

#include "fuzz.h"
#include "global_ba/global_ba.h"
#include "link/agent_key.h"
#include "loop_verification/drift_gate.h"
#include "options/yaml_options.h"
#include "posegraph/posegraph.h"
#include "session/session_file/session_file.h"
#include "thinning/thinning.h"
#include "vio/vio_file_options.h"

namespace pangea::fuzz {
namespace {

template <typename Options>
void ReadOptions(const std::string& text) {
  Options options;
  YamlOptions yaml;
  options.Visit(yaml);
  yaml.ReadText(text, "options.yaml");
  const std::string printed = yaml.Print();
  YamlOptions again;
  options.Visit(again);
  again.ReadText(printed, "printed.yaml");
  Require(again.Print() == printed, "the options printed read back the same");
}

void ReadSession(const std::string& text) {
  const auto file = ScratchFolder() / "session.yaml";
  WriteFile(file, {reinterpret_cast<const uint8_t*>(text.data()), text.size()});
  session::ReadSessionFile(file, ScratchFolder());
}

void ReadKey(const std::string& text) {
  const auto file = ScratchFolder() / "agent_1.key";
  WriteFile(file, {reinterpret_cast<const uint8_t*>(text.data()), text.size()});
  std::filesystem::permissions(
      file, std::filesystem::perms::owner_read | std::filesystem::perms::owner_write);
  ReadKeyFile(file);
}

}  // namespace
}  // namespace pangea::fuzz

static int FuzzOptions(const uint8_t* data, size_t size) {
  using namespace pangea;
  void (*const targets[])(const std::string&) = {
      fuzz::ReadSession,
      fuzz::ReadOptions<vio::VioFileOptions>,
      fuzz::ReadOptions<LoopVerificationOptions>,
      fuzz::ReadOptions<PoseGraphOptions>,
      fuzz::ReadOptions<GlobalBaOptions>,
      fuzz::ReadOptions<ThinningOptions>,
      fuzz::ReadKey,
  };
  if (size > 0) {
    try {
      targets[data[0] % std::size(targets)]({data + 1, data + size});
    } catch (const std::runtime_error& error) {
      fuzz::Require(*error.what() != 0, "a refusal has a reason");
    }
  }
  return 0;
}
static const pangea::fuzz::Target kOptions("options", FuzzOptions);
