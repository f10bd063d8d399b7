// A request to the API of anchors: "METHOD TARGET\n", then the body. Edits that the API requests
// are journalled and passed back to it.

#include <nlohmann/json.hpp>

#include "anchors/api/anchor_api.h"
#include "core/testing/synthetic_world.h"
#include "fuzz.h"
#include "messages/anchor_messages.h"

namespace pangea::fuzz {
namespace {

const SyntheticWorld& World() {
  static const SyntheticWorld world = [] {
    SyntheticWorldOptions options;
    options.num_keyframes = 3;
    options.with_corners = false;
    return MakeSyntheticWorld(options);
  }();
  return world;
}

class Apps {
 public:
  Apps()
      : anchors_(options_), api_(anchors_, options_, [this](const AnchorEdit& edit) {
          Require(Parse(ToMessage(edit)).value.has_value(),
                  "an edit that is asked for is a good message");
          edits_.push_back(edit);
        }) {
    for (const SyntheticAgent& agent : World().agents) {
      for (const Keyframe& keyframe : agent.keyframes) {
        anchors_.Take(keyframe);
      }
    }
    AnchorEdit first;
    first.anchor = {1, 17};
    first.placement = AnchorEdit::Placement::kKeyframe;
    first.map = World().agents[0].map;
    edits_.push_back(first);
    api_.Tick(1'000'000, true);
    Journal();
  }

  void Ask(const web::WebRequest& request) {
    int answers = 0;
    api_.Answer(request, [&](const web::WebAnswer& answer) {
      ++answers;
      Require(answer.body.empty() || nlohmann::json::accept(answer.body), "an answer is JSON");
      Require(answer.status != 400 || answer.body.find("error") != std::string::npos,
              "a refusal has a reason");
    });
    Journal();
    api_.Tick(1'000'000 + AnchorApi::kTimeout_us, true);
    Require(answers == 1, "each request has one answer");
  }

 private:
  void Journal() {
    for (AnchorEdit& edit : std::exchange(edits_, {})) {
      edit.right = AnchorRight::kEditAll;
      api_.Take(edit, anchors_.Take(edit));
    }
  }

  const AnchorsOptions options_;
  Anchors anchors_;
  std::vector<AnchorEdit> edits_;
  AnchorApi api_;
};

}  // namespace
}  // namespace pangea::fuzz

static int FuzzAnchorApi(const uint8_t* data, size_t size) {
  using namespace pangea;
  const std::string text(data, data + size);
  const size_t line = std::min(text.find('\n'), text.size());
  const size_t space = std::min(text.find(' '), line);
  const size_t target = std::min(space + 1, line);
  fuzz::Apps apps;
  const std::string body = text.substr(std::min(line + 1, text.size()));
  apps.Ask({text.substr(0, space), text.substr(target, line - target), "localhost", "", body});
  // Tests the body's decoder alone, independently of the first line.
  apps.Ask({"PUT", "/v1/anchors/1/17", "localhost", "\"1\"", body});
  apps.Ask({"GET", "/v1/anchors", "localhost", "", ""});
  return 0;
}
static const pangea::fuzz::Target kAnchorApi("anchor_api", FuzzAnchorApi);
