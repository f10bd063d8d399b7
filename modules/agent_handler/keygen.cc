#include "agent_handler/keygen.h"

#include <fmt/format.h>

#include <filesystem>
#include <iostream>

#include "files/make_folder.h"
#include "link/agent_key.h"

namespace pangea {
namespace {

namespace fs = std::filesystem;

// A folder that is made for keys is its owner's alone.
void MakeKeyFolder(const fs::path& folder) {
  if (!folder.empty() && !fs::exists(folder)) {
    MakeFolder(folder);
    fs::permissions(folder, fs::perms::owner_all);
  }
}

}  // namespace

CLI::App* AddKeygen(CLI::App& app, KeygenArguments* arguments) {
  CLI::App* keygen = app.add_subcommand("keygen", "Make the key that lets an agent in, and exit");
  keygen->add_option("--agent", arguments->agent_id, "agent id")
      ->required()
      ->check(CLI::Range(1, 65535));
  keygen->add_option(
      "--out", arguments->file,
      "file to make, with its folder; never written over (default: agent_ID.key here)");
  keygen
      ->add_option(
          "--anchors", arguments->anchors,
          "what the agent may do with anchors: read, own (edit those it made), write (edit "
          "all)")
      ->capture_default_str()
      ->check(CLI::IsMember({"read", "own", "write"}));
  return keygen;
}

int Keygen(const KeygenArguments& arguments) {
  const std::string file =
      arguments.file.empty() ? KeyFileName(arguments.agent_id) : arguments.file;
  MakeKeyFolder(fs::path(file).parent_path());
  MakeKeyFile(file, arguments.agent_id, AnchorRightOf(arguments.anchors).value());
  std::cout << fmt::format(
      "{}: for agent {} (pangea-uplink --key); the server needs it, or a copy, in its folder "
      "of keys (--keys, or a site's keys/)\n",
      file, arguments.agent_id);
  return 0;
}

}  // namespace pangea
