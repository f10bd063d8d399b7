#include <CLI/CLI.hpp>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "anchors/anchors_process.h"
#include "anchors/api/anchors_server.h"
#include "server_process/process_main.h"

// KEYFRAME_*, MAP_STATE, CORRECTION_*, POSE_*, ANCHOR_EDIT --> AnchorsProcess --> ANCHOR_k, ANCHOR,
//                                                                                 OTHERS_k
//                                     HTTP <--> AnchorApi --> ANCHOR_REQUEST_0
int main(int argc, char** argv) {
  pangea::AnchorsOptions options;
  pangea::ScratchFileOptions scratch;
  pangea::YamlOptions yaml;
  options.Visit(yaml);
  std::string http;
  std::vector<std::string> origins, names;
  const auto add_arguments = [&](CLI::App& app) {
    auto* const http_option = app.add_option(
        "--http", http, "ADDRESS:PORT of the API for apps, as 127.0.0.1:8090; without it none");
    app.add_option("--allow-origin", origins,
                   "pages of this origin may use the API, as https://app.example; repeatable")
        ->needs(http_option);
    app.add_option("--http-name,--name", names,
                   "a name of this machine by which apps may ask; repeatable")
        ->needs(http_option);
  };
  const auto make = [&](pangea::Bus& bus) -> std::unique_ptr<pangea::Process> {
    auto records = std::make_shared<pangea::ScratchFile>(scratch);
    if (http.empty()) {
      return std::make_unique<pangea::AnchorsProcess>(bus, options, std::move(records));
    }
    pangea::web::WebOptions web_options = pangea::ListenAt(http);
    web_options.origins = origins;
    web_options.names = names;
    return std::make_unique<pangea::AnchorsServer>(bus, options, std::move(records), web_options);
  };
  return pangea::ProcessMain(
      argc, argv,
      {"pangea-anchors", "Holds anchors in the maps, and tells agents and apps where they are",
       yaml, &scratch, nullptr, add_arguments},
      make);
}
